"""Files: pictures read and written, files that are written whole or not at all, and the cache of maps on disk.

Imports ``base``. Start with ``whole.py`` for writing and ``pictures.py`` for pictures.
"""
