"""Defines rigid bodies, links, joints and skeletons."""
