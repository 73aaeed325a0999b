"""A benchmark's section is replaced as a whole, and what was measured elsewhere says so."""

from pathlib import Path

from bench.report import write_section


def test_a_section_replaces_its_own_and_nothing_else(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Benchmarks\n\n## A\n\nold\n\n## B\n\nkept\n")
    write_section("A", "new", page=page)
    write_section("C", "more", page=page)
    expected = "# Benchmarks\n\n## A\n\nnew\n\n## B\n\nkept\n\n## C\n\nmore\n"
    assert page.read_text() == expected
    write_section("C", "more", page=page)
    assert page.read_text() == expected
