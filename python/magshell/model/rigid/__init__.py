"""Rigid bodies, links, joints and skeletons."""
