"""The leaderboard as LaTeX, in the form of the paper's table."""

from __future__ import annotations

from arena.exports.tables import LeaderboardTable, Row

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

_CAPTION = r"Elo with 95\% Confidence Intervals."


def latex(table: LeaderboardTable) -> str:
    """The table with its comments: needs booktabs and xcolor with the option `table`."""
    comments = [
        r"% \usepackage{booktabs} and \usepackage[table]{xcolor}",
        f"% {_one_line(table.study)}: {table.votes} votes; {table.method_text}",
        f"% votes sha256 {table.votes_sha256}",
        *(f"% {_one_line(warning)}" for warning in table.warnings),
    ]
    marks = [word for word, so in (("simulated", table.simulated), ("early", table.early)) if so]
    caption = f"{_CAPTION} ({', '.join(marks)})" if marks else _CAPTION
    lines = [
        *comments,
        _HEAD,
        *(f"    {_line(row)}" for row in table.rows),
        r"    \bottomrule",
        r"    \end{tabular}",
        rf"    \caption{{{caption}}}",
        r"    \label{tab:elo}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def escape(text: str) -> str:
    """Text that TeX prints as it is."""
    return "".join(_ESCAPES.get(letter, letter) for letter in _one_line(text))


def _line(row: Row) -> str:
    cells = (_model(row), row.rank_text, row.elo_text, row.interval_text, str(row.votes))
    return " & ".join(cells) + r"\\"


def _model(row: Row) -> str:
    """The model's name, its variant in typewriter letters as in the paper."""
    if not row.variant:
        return escape(row.model)
    before, _, after = row.model.rpartition(row.variant)
    return rf"{escape(before)}\texttt{{{escape(row.variant)}}}{escape(after)}"


def _one_line(text: str) -> str:
    """Line breaks would end a comment or start a paragraph."""
    return " ".join(text.split()) if "\n" in text or "\r" in text else text
