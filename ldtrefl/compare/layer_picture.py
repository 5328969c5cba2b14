"""Layered depth textures as a picture (the paper's Fig. 3): one row a layer, one column a face.

Colours show the normal of the surface that the face sees (red, green, blue = x, y, z), darkened with depth.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.ldt.texel_frame import FACE_NAMES
from ldtrefl.ldt.texture import LayeredDepthTexture

BACKGROUND = (1.0, 1.0, 1.0)
MARGIN = 8
"""Pixels between the pictures."""
LABEL_HEIGHT = 18
"""Pixels for the faces' names."""
FARTHEST_SHADE = 0.45
"""Brightness of the far end of the box; its near end has 1."""


def draw_layers(maps: LayeredDepthTexture) -> np.ndarray:
    """(h, w, 3) linear: layer 1 of the six faces in the first row, and so on until a layer draws nothing."""
    layers = list(maps.layers().values())
    faces = [_face_layers(maps, face, count) for face, count in enumerate(layers)]
    tile = maps.resolution
    rows = [[pictures[row] if row < len(pictures) else None for pictures in faces] for row in range(max(1, *layers))]
    heights = [max((picture.shape[0] for picture in row if picture is not None), default=1) for row in rows]
    size = (LABEL_HEIGHT + sum(heights) + MARGIN * (len(rows) + 1), 6 * (tile + MARGIN) + MARGIN, 3)
    sheet = np.full(size, BACKGROUND, np.float32)
    top = LABEL_HEIGHT + MARGIN
    for row, height in zip(rows, heights, strict=True):
        for face, picture in enumerate(row):
            if picture is not None:
                h, w = picture.shape[:2]
                y, x = top + (height - h) // 2, MARGIN + face * (tile + MARGIN) + (tile - w) // 2
                sheet[y : y + h, x : x + w] = picture
        top += height + MARGIN
    return linear_from_srgb(_labelled(sheet, tile, layers))


def _face_layers(maps: LayeredDepthTexture, face: int, count: int) -> list[np.ndarray]:
    """The first ``count`` layers of surfaces that look at ``face``, nearest first, encoded colours."""
    axis, from_low = face // 2, face % 2 == 1
    rows, columns = maps.frame.map_shape(axis)
    first = maps.frame.first_texels
    start = maps.start.numpy()[first[axis] : first[axis + 1] + 1]
    texel = np.repeat(np.arange(rows * columns), np.diff(start))
    span = slice(int(start[0]), int(start[-1]))
    depth, reference = maps.depth.numpy()[span], maps.reference.numpy()[span]

    # Number the fragments that face this way from the face inwards.
    seen = (reference & 1) == (0 if from_low else 1)
    texel, depth, triangle = texel[seen], depth[seen], reference[seen] >> 1
    size = maps.frame.size[axis]
    from_face = depth if from_low else size - depth
    order = np.lexsort((from_face, texel))
    texel, from_face, triangle = texel[order], from_face[order], triangle[order]
    new = np.concatenate([[True], texel[1:] != texel[:-1]]) if len(texel) else np.zeros(0, bool)
    begins = np.maximum.accumulate(np.where(new, np.arange(len(texel)), 0))
    layer = np.arange(len(texel)) - begins

    corners = maps.geometry.mesh.unit_vertices[maps.geometry.mesh.faces[triangle]].astype(float)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    shade = 1.0 - (1.0 - FARTHEST_SHADE) * np.clip(from_face / size, 0, 1)
    color = (0.5 + 0.5 * normal) * shade[:, None]

    pictures = []
    for number in range(count):
        picture = np.full((rows * columns, 3), BACKGROUND, np.float32)
        picture[texel[layer == number]] = color[layer == number]
        pictures.append(_upright(picture.reshape(rows, columns, 3), face))
    return pictures


def _upright(picture: np.ndarray, face: int) -> np.ndarray:
    """Rows run along v, columns along u; turn them so that z (y on the z faces) points up, seen from outside."""
    axis, from_low = face // 2, face % 2 == 1
    if axis == 1:  # u = z, v = x
        picture = picture.transpose(1, 0, 2)
    picture = picture[::-1]
    mirrored = from_low if axis != 1 else not from_low
    return picture[:, ::-1] if mirrored else picture


def _labelled(sheet: np.ndarray, tile: int, layers: list[int]) -> np.ndarray:
    image = Image.fromarray(np.round(sheet * 255).astype(np.uint8))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default()
    for face, name in enumerate(FACE_NAMES):
        words = f"{name}: {layers[face]} layer{'' if layers[face] == 1 else 's'}"
        draw.text((MARGIN + face * (tile + MARGIN), 4), words, fill=(0, 0, 0), font=font)
    return np.asarray(image, np.float32) / 255.0
