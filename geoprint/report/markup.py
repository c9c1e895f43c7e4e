"""HTML that is escaped by construction: text becomes markup only through `element`."""

from __future__ import annotations

import html
import json
import re
from typing import TypeAlias, final

# What can be put into JSON; arrays are encoded before.
Json: TypeAlias = "dict[str, Json] | list[Json] | str | int | float | bool | None"

VOID_TAGS = frozenset({"img", "input", "meta", "br"})
# Elements that hold text and no others.
TEXT_TAGS = frozenset({"title", "option", "style", "script"})
# What sentences quote of a command line.
_QUOTED, _CODE = re.compile(r"`([^`\n]+)`"), r"<code>\1</code>"


@final
class Markup(str):
    """Text that is HTML already and is not escaped again."""

    __slots__ = ()


def element(tag: str, *children: str, **attributes: str | int | bool) -> Markup:
    """Return an element; plain text among its children and all attribute values are escaped, `commands` set as such.

    Args:
        tag: its name.
        *children: text, or markup, which stays as it is.
        **attributes: a trailing underscore is dropped and others become dashes; True stands alone, False is left out.

    Returns:
        The element.

    Examples:
        >>> element("p", "2 < 3 ", element("b", "so"), class_="note", hidden=True)
        '<p class="note" hidden>2 &lt; 3 <b>so</b></p>'
    """
    words = [tag]
    for name, value in attributes.items():
        key = name.rstrip("_").replace("_", "-")
        if value is True:
            words.append(key)
        elif value is not False:
            words.append(f'{key}="{html.escape(str(value))}"')
    if tag in VOID_TAGS:
        return Markup(f"<{' '.join(words)}>")
    content = "".join(map(_escaped, children)) if tag in TEXT_TAGS else joined(*children)
    return Markup(f"<{' '.join(words)}>{content}</{tag}>")


def joined(*pieces: str) -> Markup:
    """Return pieces one after the other, plain text escaped and `commands` in it set as such."""
    return Markup("".join(p if isinstance(p, Markup) else _QUOTED.sub(_CODE, html.escape(p)) for p in pieces))


def _escaped(piece: str) -> str:
    return piece if isinstance(piece, Markup) else html.escape(piece)


def script_data(value: Json) -> Markup:
    r"""Return JSON that can stand inside a script element whatever its strings hold.

    Examples:
        >>> script_data({"name": "</script>"})
        '{"name":"\\u003c/script\\u003e"}'
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
