"""Files: pictures read and written, files that are written whole or not at all, and the cache of maps on disk.

Imports ``base``. Start with ``atomic_write.py`` for writing, ``picture_reading.py`` for pictures and ``map_cache.py`` for
the cache.
"""
