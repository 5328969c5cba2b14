"""What every room needs and what knows nothing of pictures: errors in one line, the memory budget, checked values.

Imports nothing of the package. Start with ``errors.py``, then ``budget.py``.
"""
