"""Defines shells, and what results say of their strains and stresses."""
