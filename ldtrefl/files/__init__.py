"""Files: pictures read and written, files that are written whole or not at all, and the cache of maps on disk.

Imports ``base``. Start with ``picture_reading.py`` for pictures, ``atomic_write.py`` for writing, and ``map_cache.py``
for the cache.
"""
