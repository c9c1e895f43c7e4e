"""The guide: pages of Markdown in `pages/`, each found by itself, and the whole as one HTML page that opens offline.

They stand in four parts: tutorials, how-to, reference and explanation. A new page is one file there and its picture in
`pictures/`, which `python -m benchmarks.guide` draws.
"""

from geoprint.guide.pages import (
    Block as Block,
    Page as Page,
    html_guide as html_guide,
    page_named as page_named,
    pages as pages,
    picture_bytes as picture_bytes,
)
