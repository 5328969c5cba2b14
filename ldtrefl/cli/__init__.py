"""The command line.

Imports everything else. Start with ``commands.py``.
"""
