"""The parts of ``paper_tables.py``: a paper a file, and what ours adds."""
