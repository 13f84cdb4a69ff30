"""Elements: text stays text, whatever it is."""

from html.parser import HTMLParser

from hypothesis import given
from hypothesis import strategies as st

from shearline.record.report.markup import Markup, join, tag

TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\r\0"))


class Heard(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.said: list[object] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.said.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.said and isinstance(self.said[-1], str):
            self.said[-1] += data
        else:
            self.said.append(data)


@given(TEXT, TEXT)
def test_text_and_attributes_come_out_as_they_went_in(text: str, value: str) -> None:
    heard = Heard(tag("p", text, title=value))
    assert heard.said == [("p", {"title": value}), *([text] if text else [])]


def test_markup_is_not_escaped_twice() -> None:
    assert tag("p", tag("b", "a < b"), " & c") == "<p><b>a &lt; b</b> &amp; c</p>"
    assert join([Markup("<i>"), None, "<i>"]) == "<i>&lt;i&gt;"


def test_attributes_may_be_there_or_not() -> None:
    written = tag("input", checked=True, disabled=False, id=None, aria_label="x", width=1.50)
    assert written == '<input checked aria-label="x" width="1.5">'
