"""The command line: one file a command in ``commands/``, and what they share.

Imports every other room. Start with ``program.py``, which runs a command and turns what it raises into an exit status;
a new command is a file in ``commands/``.
"""
