"""Mesh files in many formats, read by well-kept libraries and checked. Start with ``mesh_files.py``."""
