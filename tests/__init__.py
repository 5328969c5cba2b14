"""Tests, in the rooms of what they test: ``ldtrefl/a/b.py`` is tested by ``tests/a/test_b.py``, and if that would be
too long by several, ``test_b_this.py`` and ``test_b_that.py``.

Tests of the whole stand at the top: habits of the code, imports, README, closed forms, the shipped scenes.
``conftest.py`` and the other files without ``test_`` hold what several of them share.
"""
