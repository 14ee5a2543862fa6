"""Messages: each has its place on the site, and says what to do."""

import re

from docs.site import errors
from growthx.cli.machine import pages

FOUND = errors.messages()


def test_every_message_is_on_the_page():
    """With an anchor of its own, in the order of the code, whatever it quotes."""
    page = errors.page()
    anchors = re.findall(r'<a id="([\w-]+)"', page)
    assert anchors == [message.anchor for message in FOUND]
    assert len(set(anchors)) == len(anchors) > 400
    assert all(f'href="#{anchor}"' in page for anchor in anchors)


def test_known_messages_have_the_anchors_that_were_linked():
    """Who has written one down finds it there next year."""
    told = {message.anchor: message.text for message in FOUND}
    assert told["scenes-bar--problem"].startswith("there is no bar problem '…': one of … would be right")
    assert "without one the body is free to move" in told["model-scene-scene---post-init---5"]


def test_messages_say_what_to_do():
    """What is right, needed or there: naming what is wrong is not enough."""
    assert [message.anchor for message in FOUND if message.raised and not message.advises] == []


def test_every_message_has_a_page_to_read_on():
    """As the page on messages and `growthx help` name it; pages that are not there, and parts of no code, are found."""
    assert {page for module in {message.module for message in FOUND} for page in pages.pages_on(module)} <= set(
        pages.titles()
    )
    named = {page for told in (*pages.TELL.values(), pages.GENERAL) for page in told}
    assert named <= set(pages.titles())
    for part in pages.TELL:
        path = errors.ROOT / "growthx" / part.replace(".", "/")
        assert path.is_dir() or path.with_suffix(".py").is_file() or list(path.parent.glob(f"{path.name}*.py")), part
    assert pages.pages_on("model.loads") == pages.pages_on("model.scene") != pages.pages_on("model.program")
