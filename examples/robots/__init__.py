"""Robots of [Qiao21] that swim or carry to a target: `robots.environments` makes environments of them."""
