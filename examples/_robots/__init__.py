"""The common parts of the examples in which a robot goes to a target: the search by gradient, and its pictures."""
