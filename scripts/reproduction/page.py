"""The page: docs/REPRODUCTION.md, written from what items report, never by hand."""
from pathlib import Path

from rd_runs import write_text
from reproduction.reasons import why
from reproduction.work import BEATEN, MET, NOT, OPEN, table

HEAD = """# The thesis again

Tables and figures of chapters 4 and 8 of R. Amjoun, *Compression of Static and Dynamic Three-Dimensional Meshes*, made with
this program. This page is written by one command, which also makes every table and plot it names; nothing of it is changed by hand:

```
scripts/reproduce.py CLIPS --meshes MESHES
```

The thesis' curves exist as pictures only, of which no copy was to be had: what is compared with is what tables print and the
text states. Rates are those of the geometry in bits a vertex and frame, as the literature counts them, every byte of a
clip's streams included; `da` is in percent. The dolphin and the snake are not to be had; samba stands in for them where a
figure needs one. *Beaten*: our value is better than the printed one by more than 2 %; *met*: it is within 2 % (gains: 2
points), or the statement holds (similar: at most 10 % larger); *not*: anything else. A table or figure is *beaten* if all of
it is met and more than half of it beaten, *partly* met if some of it is met and some is not. *Open*: it cannot be judged, or
is not measured yet. Baselines stand for what others published: [BASELINES.md](BASELINES.md).

"""


def summary_cell(section):
    """How many values are of which verdict."""
    counts = {verdict: sum(check.verdict == verdict for check in section.checks) for verdict in (BEATEN, MET, NOT, OPEN)}
    return ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)


def anchor(title):
    """What a heading is linked by, as GitHub makes it."""
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c in "-_")


def of_section(item, section, folder):
    out = [f"## {item.title}", ""]
    if section is None:
        return [*out, "Not measured yet.", ""]
    out += [section.shows, "", f"**{section.verdict().capitalize()}** ({summary_cell(section) or 'nothing to judge'})."
            + (f" {why(item.name)}" if why(item.name) else ""), ""]
    for note in section.notes:
        out += [note, ""]
    if section.checks:
        out += ["<details><summary>Every value and statement</summary>", "",
                table(["what", "thesis", "ours", "verdict"], [[c.what, c.thesis, c.ours, c.verdict] for c in section.checks]), "",
                "</details>", ""]
    pictures = [name for name in section.files if name.endswith(".svg")]
    out += [f"![{item.title}]({folder}/{name})" for name in pictures]
    out += ["", "Files: " + ", ".join(f"[{name}]({folder}/{name})" for name in section.files) + ".", ""] if section.files else [""]
    return out


def write(path, reports, folder):
    """reports: (item, section or None) in the page's order. folder: of the files, from the page."""
    lines = [[f"[{item.title}](#{anchor(item.title)})", section.verdict() if section else OPEN, summary_cell(section) if section else
              "not measured yet"] for item, section in reports]
    out = [table(["", "verdict", "values and statements"], lines), ""]
    for item, section in reports:
        out += of_section(item, section, folder)
    write_text(Path(path), HEAD + "\n".join(out).rstrip() + "\n")
