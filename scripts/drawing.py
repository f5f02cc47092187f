"""Plots as SVG without a library: curves over linear or logarithmic axes, and bars."""
import html
import math
from dataclasses import dataclass, field

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 860, 560, 66, 216, 44, 56
# Okabe and Ito's colours, told apart by all; yellow is left out, too pale on white.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#555555", "#56b4e9", "#8b5a2b", "#7a3fa0", "#000000")


@dataclass
class Axis:
    """What an axis says and shows; without low and high it holds every point, with a margin."""
    label: str
    log: bool = False
    low: float | None = None
    high: float | None = None

    def fit(self, values):
        if self.log:
            values = [value for value in values if value > 0]
        if not values:
            values = [1.0, 2.0]
        low, high = min(values), max(values)
        margin = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
        self.low = self.low if self.low is not None else low / 1.12 if self.log else low - margin
        self.high = self.high if self.high is not None else high * 1.12 if self.log else high + margin

    def part(self, value):
        """Where a value is from low to high, as 0 to 1."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def holds(self, value):
        return self.low <= value <= self.high and (value > 0 or not self.log)

    def ticks(self):
        return log_ticks(self.low, self.high) if self.log else linear_ticks(self.low, self.high)


@dataclass
class Curve:
    name: str
    points: list  # (x, y), in the order of the line
    colour: str
    dots: bool = True
    dash: str = ""
    words: list = field(default_factory=list)  # of each point, shown under the pointer


@dataclass
class Marks:
    name: str
    points: list
    shape: str  # path around 0, 0


def log_ticks(low, high):
    """1, 2 and 5 times powers of ten from low to high; more where these are few."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for parts in ((1, 2, 5), (1, 1.5, 2, 3, 4, 5, 6, 7, 8)):
        found = [x for decade in decades for part in parts if low <= (x := part * 10.0 ** decade) <= high]
        if len(found) >= 4:
            break
    return found


def linear_ticks(low, high, most=8):
    size = 10.0 ** (math.floor(math.log10(high - low)) - 1)
    step = next(size * part for part in (1, 2, 5, 10, 20, 50, 100) if (high - low) / (size * part) <= most)
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def start(title, note, width=WIDTH, height=HEIGHT):
    return [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
            'font-family="sans-serif" font-size="12" fill="#222" role="img">',
            f'<title>{html.escape(title)}</title>', f'<rect width="{width}" height="{height}" fill="white"/>',
            f'<text x="{LEFT}" y="{TOP - 18}" font-size="15">{html.escape(title)}</text>',
            f'<text x="{width - RIGHT}" y="{TOP - 18}" text-anchor="end" fill="#555">{html.escape(note)}</text>']


def grid(x_axis, y_axis, at_x, at_y):
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    whole = lambda axis, value: not axis.log or f"{value:e}"[0] == "1"
    out = [f'<clipPath id="plot"><rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}"/></clipPath>']
    for x in x_axis.ticks():
        out.append(f'<path d="M{at_x(x):.1f} {TOP}V{bottom}" stroke="{"#bbb" if whole(x_axis, x) else "#e6e6e6"}"/>'
                   f'<text x="{at_x(x):.1f}" y="{bottom + 18}" text-anchor="middle">{x:.6g}</text>')
    for y in y_axis.ticks():
        out.append(f'<path d="M{LEFT} {at_y(y):.1f}H{right}" stroke="{"#bbb" if whole(y_axis, y) else "#e6e6e6"}"/>'
                   f'<text x="{LEFT - 7}" y="{at_y(y) + 4:.1f}" text-anchor="end">{y:.4g}</text>')
    out.append(f'<rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}" fill="none" stroke="#888"/>')
    out.append('<g text-anchor="middle">'
               f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 14}">{html.escape(x_axis.label)}</text>'
               f'<text x="{-(TOP + bottom) / 2}" y="16" transform="rotate(-90)">{html.escape(y_axis.label)}</text></g>')
    return out


def draw_curves(title, note, x_axis, y_axis, curves, marks=()):
    """SVG of curves and marks; what lies outside the axes is cut."""
    points = [point for some in [*curves, *marks] for point in some.points]
    x_axis.fit([x for x, _ in points])
    y_axis.fit([y for _, y in points])
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    at_x = lambda x: LEFT + x_axis.part(x) * (right - LEFT)
    at_y = lambda y: bottom - y_axis.part(y) * (bottom - TOP)
    out = start(title, note) + grid(x_axis, y_axis, at_x, at_y)
    legend = TOP + 12
    for curve in curves:
        drawn = [(x, y) for x, y in curve.points if (x > 0 or not x_axis.log) and (y > 0 or not y_axis.log)]
        if not drawn:
            continue
        path = "L".join(f"{at_x(x):.1f} {at_y(y):.1f}" for x, y in drawn)
        dash = f' stroke-dasharray="{curve.dash}"' if curve.dash else ""
        out.append(f'<g clip-path="url(#plot)" fill="{curve.colour}"><path d="M{path}" fill="none" stroke="{curve.colour}" '
                   f'stroke-width="2" stroke-linejoin="round"{dash}/>')
        for (x, y), word in zip(curve.points, curve.words or [""] * len(curve.points)):
            if curve.dots and x_axis.holds(x) and y_axis.holds(y):
                out.append(f'<circle cx="{at_x(x):.1f}" cy="{at_y(y):.1f}" r="2.4"><title>{html.escape(curve.name)} '
                           f'{html.escape(word)}: {x:.3g}, {y:.3g}</title></circle>')
        out.append("</g>")
        out.append(f'<path d="M{right + 18} {legend - 4}h26" stroke="{curve.colour}" stroke-width="2"{dash}/>'
                   f'<text x="{right + 52}" y="{legend}">{html.escape(curve.name)}</text>')
        legend += 20
    legend += 12
    for some in marks:
        shown = [(at_x(x), at_y(y)) for x, y in some.points if x_axis.holds(x) and y_axis.holds(y)]
        for x, y in shown + [(right + 31, legend - 4)]:
            out.append(f'<path d="{some.shape}" transform="translate({x:.1f} {y:.1f})" fill="white" fill-opacity="0.8" '
                       'stroke="#222" stroke-width="1.3"/>')
        out.append(f'<text x="{right + 52}" y="{legend}">{html.escape(some.name)}</text>')
        legend += 20
    return "\n".join(out + ["</svg>"]) + "\n"


def draw_bars(title, note, panels):
    """SVG of horizontal bars. panels: (label, [(name, value, colour, what stands behind the bar)])."""
    height = TOP + sum(44 + 26 * len(bars) for _, bars in panels) + 16
    out, y, left = start(title, note, height=height), TOP, LEFT + 130
    for label, bars in panels:
        out.append(f'<text x="{LEFT}" y="{y + 18}" fill="#555">{html.escape(label)}</text>')
        y += 30
        most = max((value for _, value, _, _ in bars), default=1.0) or 1.0
        for name, value, colour, behind in bars:
            length = (WIDTH - RIGHT - left) * value / most
            out.append(f'<text x="{left - 8}" y="{y + 14}" text-anchor="end">{html.escape(name)}</text>'
                       f'<rect x="{left}" y="{y}" width="{length:.1f}" height="19" fill="{colour}"/>'
                       f'<text x="{left + length + 6:.1f}" y="{y + 14}">{html.escape(behind)}</text>')
            y += 26
        y += 14
    return "\n".join(out + ["</svg>"]) + "\n"
