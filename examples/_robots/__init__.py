"""What the examples of robots that go to a target share: the search by gradient, from several starts, and its pictures."""
