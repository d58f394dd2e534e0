"""Error, over what is allowed, against seconds, on logarithmic axes, as a picture of its own."""

import math
from html import escape

WIDTH, HEIGHT = 840, 380
LEFT, RIGHT, TOP, BOTTOM = 100, 210, 30, 52
ALLOWED = 100
STYLE = (
    "text { font: 12px system-ui, sans-serif; fill: #1a1d21; } .tick { fill: #5a6370; } .grid { stroke: #d5dae1; } .allowed { stroke: #4f7a28; stroke-dasharray: 6 4; } "
    ".front { fill: none; stroke: #1f5fa8; stroke-width: 1.2; } .exact { fill: #1f5fa8; } .lumped { fill: none; stroke: #b4560d; stroke-width: 1.6; } .ring { fill: none; stroke: #1a1d21; stroke-width: 1.6; }"
)


def decades(values, least):
    """First and last power of ten around the values, at least so many decades."""
    first, last = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return (first, max(last, first + least))


def fastest(points):
    """The exact points that no faster one is as accurate as, by their seconds."""
    front = []
    for point in sorted(points):
        if not point[3] and (not front or point[1] < front[-1][1]):
            front.append(point)
    return front


def figure(title, points):
    """`points`: [(seconds, error in per cent of what is allowed, name, lumped, recommended)]."""
    seconds, errors = [point[0] for point in points], [point[1] for point in points] + [ALLOWED]
    (x0, x1), (y0, y1) = decades(seconds, 1), decades(errors, 2)
    taken = "".join(f" (ring: {name})" for _, _, name, _, recommended in points if recommended)

    def x(value):
        return LEFT + (WIDTH - LEFT - RIGHT) * (math.log10(value) - x0) / (x1 - x0)

    def y(value):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (math.log10(value) - y0) / (y1 - y0)

    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">',
        f'<title>{escape(title)}</title><style>{STYLE}</style><rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
        f'<text x="{LEFT}" y="18">{escape(title + taken)}</text>',
    ]
    for power in range(x0, x1 + 1):
        at = x(10**power)
        out.append(f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/><text class="tick" x="{at:.1f}" y="{HEIGHT - BOTTOM + 17}" text-anchor="middle">{10.0**power:g} s</text>')
    step = max(1, math.ceil((y1 - y0) / 8))
    for power in range(y0, y1 + 1, step):
        at = y(10**power)
        out.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/><text class="tick" x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">{10.0**power:g} %</text>')
    at = y(ALLOWED)
    out.append(f'<line class="allowed" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/><text x="{WIDTH - RIGHT + 8}" y="{at + 4:.1f}">allowed</text>')
    front = fastest(points)
    if len(front) > 1:
        out.append('<polyline class="front" points="' + " ".join(f"{x(point[0]):.1f},{y(point[1]):.1f}" for point in front) + '"/>')
    for second, error, name, lumped, recommended in points:
        shape = f'<rect class="lumped" x="{x(second) - 4:.1f}" y="{y(error) - 4:.1f}" width="8" height="8">' if lumped else f'<circle class="exact" cx="{x(second):.1f}" cy="{y(error):.1f}" r="4">'
        out.append(f"{shape}<title>{escape(name)}: {second:.3g} s, {error:.3g} % of what is allowed</title></{'rect' if lumped else 'circle'}>")
        if recommended:
            out.append(f'<circle class="ring" cx="{x(second):.1f}" cy="{y(error):.1f}" r="9"/>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 12}" text-anchor="middle">seconds of the simulation in Exudyn</text>')
    out.append(f'<text transform="translate(18 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">largest error, % of what is allowed</text>')
    out.append(f'<circle class="exact" cx="{WIDTH - RIGHT + 14}" cy="{HEIGHT - BOTTOM - 24}" r="4"/><text x="{WIDTH - RIGHT + 26}" y="{HEIGHT - BOTTOM - 20}">exact invariants</text>')
    out.append(f'<rect class="lumped" x="{WIDTH - RIGHT + 10}" y="{HEIGHT - BOTTOM - 10}" width="8" height="8"/><text x="{WIDTH - RIGHT + 26}" y="{HEIGHT - BOTTOM - 2}">lumped mass</text>')
    out.append("</svg>")
    return "\n".join(out) + "\n"
