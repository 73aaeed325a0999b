"""How ratings are printed: -9/+11 around a whole number, and the paper's table in LaTeX."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

UNKNOWN = "--"

_ESCAPES = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
}

_HEAD = r"""\providecolor{llm_blue}{RGB}{105, 156, 219}
\begin{table}
    \centering
    \begin{tabular}{l>{\columncolor{llm_blue!20}}c r r r}
    \toprule
    \textbf{Model} & \textbf{Rank} & \textbf{Elo}~$\uparrow$ & \textbf{95\% CI} & \textbf{Votes}\\
    \midrule"""

CAPTION = r"Elo with 95\% Confidence Intervals."


def rating_text(rating: float | None) -> str:
    """The rating as a whole number, two hyphens without one."""
    return UNKNOWN if rating is None else str(round(rating))


def rank_text(rank: int | None) -> str:
    """The rank, or two hyphens without one."""
    return UNKNOWN if rank is None else str(rank)


def interval_text(rating: float | None, lower: float | None, upper: float | None) -> str:
    """The interval as the paper prints it: -9/+11 around the printed rating.

    Where a side would round to nothing, both have a decimal: no interval has the width zero.
    """
    if rating is None or lower is None or upper is None:
        return UNKNOWN
    below, above = round(lower) - round(rating), round(upper) - round(rating)
    if below and above:
        return f"{below:+d}/{above:+d}"
    return f"-{max(rating - lower, 0.1):.1f}/+{max(upper - rating, 0.1):.1f}"


def latex_table(
    rows: Iterable[Sequence[str]], *, comments: Iterable[str], caption: str = CAPTION
) -> str:
    """The paper's table; it needs booktabs and xcolor with the option `table`.

    Args:
        rows: Model, rank, rating, interval and votes, as TeX.
        comments: Lines to put before it, as plain text.
        caption: As TeX.
    """
    lines = [
        r"% \usepackage{booktabs} and \usepackage[table]{xcolor}",
        *(f"% {one_line(comment)}" for comment in comments),
        _HEAD,
        *("    " + " & ".join(row) + r"\\" for row in rows),
        r"    \bottomrule",
        r"    \end{tabular}",
        rf"    \caption{{{caption}}}",
        r"    \label{tab:elo}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def escape(text: str) -> str:
    """Text that TeX prints as it is."""
    return "".join(_ESCAPES.get(letter, letter) for letter in one_line(text))


def one_line(text: str) -> str:
    """Line breaks would end a comment or start a paragraph."""
    return " ".join(text.split()) if "\n" in text or "\r" in text else text
