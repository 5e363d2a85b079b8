"""One hue becomes another."""

import numpy as np

from plugins.assets_household.bake.recolour import recoloured


def test_named_hue_turns_and_the_others_stay() -> None:
    purple, brown = (150, 20, 160), (100, 60, 30)
    picture = np.array([[purple, brown]], np.uint8)
    found = recoloured(picture, hue_deg=296, to_deg=120)[0].astype(int)
    assert found[0].argmax() == 1
    assert found[0].max() == 160
    np.testing.assert_allclose(found[1], brown, atol=2)


def test_saturation_fades_the_turned_colour_only() -> None:
    picture = np.array([[(200, 40, 40), (40, 40, 200)]], np.uint8)
    red, blue = recoloured(picture, hue_deg=0, to_deg=0, saturation=0.0)[0].astype(int)
    assert np.ptp(red) <= 1
    np.testing.assert_allclose(blue, (40, 40, 200), atol=2)
