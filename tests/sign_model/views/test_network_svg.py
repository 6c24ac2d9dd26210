"""The picture of the three networks has every link and every sign that is linked."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from sign_model import draw_networks, world_model_of
from sign_model.blocks import random_blocks_tasks
from sign_model.signs.network import networks
from sign_model.signs.sign import Sign
from sign_model.signs.world_model import from_signs

NAMESPACE = "{http://www.w3.org/2000/svg}"


def test_an_arrow_for_each_link_and_a_panel_for_each_network():
    model = world_model_of(random_blocks_tasks(3, 1, seed=2)[0])
    root = ElementTree.fromstring(draw_networks(model))
    arrows = [path for path in root.iter(f"{NAMESPACE}path") if path.get("marker-end")]
    links = np.asarray(networks(model.matrices))
    assert len(arrows) == links.sum()
    words = [text.text for text in root.iter(f"{NAMESPACE}text")]
    for name in ("W_p: images", "W_m: significances", "W_a: personal meanings"):
        assert any(word.startswith(name) for word in words)
    assert "(stack b0 b1)" in words and "start" in words


def test_chosen_signs_alone_are_drawn():
    model = world_model_of(random_blocks_tasks(3, 1, seed=2)[0])
    picture = draw_networks(model, names=["situation goal", "(on b0 b1)", "(on b1 b2)"])
    assert picture.count("marker-end") == 2 and "unstack" not in picture


def test_too_many_signs_are_refused_and_none_make_an_empty_picture():
    with pytest.raises(ValueError, match="choose at most 200"):
        draw_networks(world_model_of(random_blocks_tasks(9, 1)[0]))
    assert draw_networks(from_signs([Sign("a & b")])).count("marker-end") == 0
