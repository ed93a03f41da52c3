"""The common parts of the designs of solids: transfer of a magnetization between meshes, and the table of its
effect.
"""
