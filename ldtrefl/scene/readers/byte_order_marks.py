"""Texts that begin with a byte order mark: those of UTF-16, which Windows' shells and editors write, become UTF-8."""

from __future__ import annotations

import codecs

from ldtrefl.base import budget

UTF_16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
"""Encodings by their marks."""

BYTES_PER_BYTE = 2.0
"""What a byte of UTF-16 takes while it is decoded, and as UTF-8; of text in Latin letters."""


def without_mark(data: bytes) -> bytes:
    """A text without its byte order mark, in UTF-8 if that says UTF-16; else as it is.

    Raises:
        InputError: it takes more memory than is allowed.
    """
    for mark, encoding in UTF_16.items():
        if data.startswith(mark):
            budget.take(BYTES_PER_BYTE * len(data), "its text")
            return data[len(mark) :].decode(encoding, "replace").encode()
    return data.removeprefix(codecs.BOM_UTF8)
