"""Tables as LaTeX and for a terminal; they need no Django.

What is unknown is a dash.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from arena.rating.lines import UNKNOWN, count_text, votes_text

_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        **{sign: f"\\{sign}" for sign in "{}&%$#_"},
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "|": r"\textbar{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "∞": r"$\infty$",
        "≤": r"$\leq$",
        "≥": r"$\geq$",
        "–": "--",
        "±": r"$\pm$",
    }
)

_BEGIN = r"""\providecolor{llm_blue}{RGB}{105, 156, 219}
\begin{table}
    \centering"""
_UPWARDS = {"Elo": r"~$\uparrow$"}
"""Where more is better."""

_HOW_TO_READ = (
    "The mean of models that are rated together is 1000, and a tie counts as half a win. Rank is "
    "1 plus the number of models whose lower bound is above the model's upper bound."
)
PLACES_LEFT = r"95\% ranks are the places left with all pairs judged at once."
"""Ends of captions, as TeX."""


def caption_text(
    method: str, *, votes: int, settled: int | None, experts: int, scenarios: int, more: str = ""
) -> str:
    """The caption as TeX: what is shown, by which method, on how many votes, and how to read it.

    Args:
        method: As plain text.
        votes: How many people gave.
        settled: How many ties count beside them; None for earlier ratings, which say less.
        experts: How many gave votes; 0 is not known.
        scenarios: On how many, likewise.
        more: Sentences to end with, as TeX.
    """
    is_old = settled is None
    numbers = ((experts, "expert|"), (scenarios, "scenario|"))
    counts = [count_text(number, what) for number, what in numbers if number > is_old]
    if votes > 1 or not is_old:
        counts.insert(0, votes_text(votes, settled))
    text = rf"Elo with 95\% confidence intervals: {escape(method)}; {', '.join(counts)}."
    return text if is_old else f"{text} {_HOW_TO_READ} {more}".rstrip()


def latex_table(
    rows: Iterable[Sequence[str]],
    *,
    comments: Iterable[str],
    heads: Sequence[str],
    notes: Iterable[str] = (),
    caption: str,
    label: str = "tab:elo",
) -> str:
    """The paper's table; it needs booktabs and xcolor with the option `table`.

    Args:
        rows: Model as TeX, then rank, rating and the rest as they are printed.
        comments: Lines to put before it, as plain text.
        heads: Of the columns, as plain text.
        notes: Lines to put beneath it, as plain text.
        caption: As TeX.
        label: For references to it.
    """
    right = " r" * (len(heads) - 2)
    titles = [rf"\textbf{{{escape(head)}}}{_UPWARDS.get(head, '')}" for head in heads]
    across = rf"\multicolumn{{{len(heads)}}}{{p{{0.8\linewidth}}}}"
    lines = [
        r"% \usepackage{booktabs} and \usepackage[table]{xcolor}",
        *(f"% {one_line(comment)}" for comment in comments),
        _BEGIN,
        rf"    \begin{{tabular}}{{l>{{\columncolor{{llm_blue!20}}}}c{right}}}",
        r"    \toprule",
        "    " + " & ".join(titles) + r"\\",
        r"    \midrule",
        # The end of a line takes a bracket or an asterisk behind it for its own.
        *(
            f"    {'{}' * name.startswith(('[', '*'))}{' & '.join([name, *map(escape, rest)])}\\\\"
            for name, *rest in rows
        ),
        r"    \bottomrule",
        *(rf"    {across}{{\footnotesize {escape(note)}}}\\" for note in notes),
        r"    \end{tabular}",
        rf"    \caption{{{caption}}}",
        rf"    \label{{{label}}}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


ValueColumns = Mapping[str, Callable[[Any], object]]
"""The value of a line, by the head of its column."""


def latex_values(
    lines: Iterable[Any], columns: ValueColumns, *, number: str = ".2f", **more: Any
) -> bytes:
    """Return a LaTeX table of plain values, those that are unknown as dashes.

    Args:
        lines: One row each.
        columns: What each shows of a line.
        number: The format of floats.
        more: As in `latex_table`.
    """

    def print_value(value: object) -> str:
        if value is None:
            return UNKNOWN
        return format(value, number) if isinstance(value, float) else str(value)

    printed = ([print_value(value(line)) for value in columns.values()] for line in lines)
    rows = ([escape(first), *others] for first, *others in printed)
    return latex_table(rows, heads=list(columns), **more).encode()


def align_cells(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a terminal: the first cell to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.rjust(width) if place else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def escape(text: str) -> str:
    """Text that TeX prints as it is."""
    return one_line(text).translate(_ESCAPES)


def one_line(text: str) -> str:
    """Line breaks would end a comment or start a paragraph."""
    return " ".join(text.split()) if "\n" in text or "\r" in text else text
