"""How accurate and how fast magshell is: python -m magshell.bench PART."""
