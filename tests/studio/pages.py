"""What is done to the page of the studio, and read there."""

from __future__ import annotations

from tests.host.browser import Tab

PROVEN = "document.getElementById('state').textContent.startsWith('Proven')"

ANSWERED = "sent === 0 || (known.document.client === me && known.document.n === sent)"
"""Whether the session has answered everything that the page has asked for."""


def text_of(tab: Tab, place: str) -> str:
    """Return the text of an element."""
    return str(tab.value(f"document.querySelector({place!r}).innerText"))


def mouse(tab: Tab, kind: str, x: float, y: float) -> None:
    """Do something with the left button."""
    tab.call(
        "Input.dispatchMouseEvent",
        type=kind,
        x=x,
        y=y,
        button="left",
        buttons=0 if kind == "mouseReleased" else 1,
        clickCount=1,
    )


def typed(tab: Tab, field: str, text: str) -> None:
    """Type into a field."""
    tab.value(f"(() => {{ const field = document.querySelector({field!r}); field.focus(); field.select(); }})()")
    tab.call("Input.insertText", text=text)
