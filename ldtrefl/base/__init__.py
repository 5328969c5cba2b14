"""What every room needs and what knows nothing of pictures: errors of one line, the memory budget, checked values.

Imports nothing of the package. Start with ``errors.py``.
"""
