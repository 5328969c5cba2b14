"""Keys by content: two things are the same if they hold the same, however often they were made."""

from __future__ import annotations

import numpy as np
import xxhash


def content_key(*contents: np.ndarray | str | None) -> str:
    """A hash (XXH3, 128 bits) of arrays, texts and what is missing: 32 hexadecimal digits.

    Of an array its type and shape count, too. It goes over some 7 GB in a second.
    """
    digest = xxhash.xxh3_128()
    for content in contents:
        if isinstance(content, np.ndarray):
            digest.update(f"array {content.dtype.str} {content.shape} ".encode())
            digest.update(np.ascontiguousarray(content).data)
        elif content is None:
            digest.update(b"none ")
        else:
            digest.update(f"text {len(content)} {content} ".encode())
    return digest.hexdigest()
