"""Textures of looks: each picture once, bytes and floats apart, alpha beside them."""

import numpy as np

from ldtrefl.device import launch
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.surface_material import Texture
from ldtrefl.world.look_records import FRACTION_BYTES, LINEAR_FLOATS, SRGB_BYTES, LookRecord
from ldtrefl.world.texture_pool import TexturePool


def test_pictures_are_uploaded_once_and_floats_that_are_fractions_are_encoded_again() -> None:
    pixels = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    with_alpha = StoredPicture(pixels, np.arange(6, dtype=np.uint8).reshape(2, 3))
    fractions = np.linspace(0, 1, 12, dtype=np.float32).reshape(1, 4, 3)
    floats = StoredPicture(linear_from_srgb(fractions))
    pool, look = TexturePool(), LookRecord()
    textures = [
        Texture(with_alpha),
        Texture(with_alpha, is_data=True, wrap=("clamp", "mirror"), uv_set=1),
        Texture(floats),
        Texture(floats, is_data=True),
    ]
    assert [pool.number_of(texture) for texture in (*textures, Texture(with_alpha))] == [0, 1, 2, 3, 0]
    pool.upload(look, launch.resolve_device("cpu"))
    records = look.textures.numpy()
    assert records["first"].tolist() == [0, 0, 0, 4] and records["first_alpha"].tolist() == [0, 0, -1, -1]
    assert records["stored"].tolist() == [SRGB_BYTES, FRACTION_BYTES, LINEAR_FLOATS, LINEAR_FLOATS]
    assert records["wrap"].tolist() == [[0, 0], [1, 2], [0, 0], [0, 0]] and records["uv_set"].tolist() == [0, 1, 0, 0]
    np.testing.assert_array_equal(look.texel_bytes.numpy(), pixels.reshape(-1, 3))
    np.testing.assert_array_equal(look.texel_alpha.numpy(), range(6))
    expected = np.concatenate([floats.pixels.reshape(-1, 3), fractions.reshape(-1, 3)])
    np.testing.assert_allclose(look.texels.numpy(), expected, atol=1e-6)
