"""Messages: each has its place on the site, and says what to do."""

import re

from docs.site import errors

FOUND = errors.messages()
# Raised messages that name what is wrong and not what would be right.  This number may only become smaller.
WITHOUT_ADVICE = 7


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
    """What is right, needed or there; those that do not are counted."""
    silent = [message.anchor for message in FOUND if message.raised and not message.advises]
    assert len(silent) <= WITHOUT_ADVICE, silent
