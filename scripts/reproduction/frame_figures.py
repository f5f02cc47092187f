"""Figures 8.11 and 8.12: error frame by frame on the chicken, as the L2 norm over all vertices, sqrt(V) times the frame's rmse."""
import math
import sys

from drawing import Axis, Curve, draw_curves
from rd_runs import encode
from reproduction.work import Check, Item, Section, holds, mean, number, table

CLIP = "chicken"
COLOURS = {"LPCA": "#009e73", "RLPCA": "#0072b2", "ORLPCA": "#d55e00"}


def keys(clusters, components=None, method="rlpca", **more):
    found = {"codec.method": method, "segmentation.method": "clustering", "segmentation.clusters": clusters, "codec.basis_bits": 12,
             "codec.coefficient_bits": 12, "codec.frame_bits": 16}
    if components:
        found["codec.components"] = components
    return {**found, **{f"codec.{key.replace('__', '.')}": value for key, value in more.items()}}


def frames_of(work, wanted):
    """What one result has: its rate, its setting and the L2 norm of each frame."""
    def read(result):
        vertices = int(result.attrs["vertex_count"])
        norms = [math.sqrt(vertices) * float(rmse) for rmse in result["metrics/frame_rmse"][()]]
        return {"bpvf": float(result["metrics"].attrs["bpvf"]), "da": float(result["metrics"].attrs["da"]), "norms": norms}
    work.processes += 1
    return encode(work.program, work.threads, work.clips[CLIP], wanted, read)


def write(work, figure, found):
    rows = [{"curve": name, "bpvf": f"{one['bpvf']:.5g}", "da": f"{one['da']:.5g}", "frame": index, "l2_norm": f"{norm:.6g}"}
            for name, one in found.items() for index, norm in enumerate(one["norms"])]
    work.write(f"{figure}.csv", rows)


def is_there(work, figure):
    return CLIP not in work.clips or bool(work.read(f"{figure}.csv")) and not work.again


def measure_8_11(work):
    if is_there(work, "figure-8.11"):
        return 0
    print("figure-8.11: LPCA in the world, RLPCA and ORLPCA at one rate", file=sys.stderr, flush=True)
    found = {"RLPCA": frames_of(work, keys(10, 10))}
    rate = found["RLPCA"]["bpvf"]
    world = [frames_of(work, keys(10, components, space="world")) for components in range(8, 15)]
    found["LPCA"] = min(world, key=lambda one: abs(one["bpvf"] - rate))
    found["ORLPCA"] = frames_of(work, keys(10, None, "orlpca", target__bpvf=rate))
    write(work, "figure-8.11", {name: found[name] for name in COLOURS})
    return 0


def measure_8_12(work):
    if is_there(work, "figure-8.12"):
        return 0
    print("figure-8.12: RLPCA with three pairs of clusters and components", file=sys.stderr, flush=True)
    write(work, "figure-8.12", {f"N {n}, L {most}": frames_of(work, keys(n, most)) for n, most in ((20, 20), (20, 10), (10, 10))})
    return 0


def series(work, figure):
    """Norms and (bpvf, da) of each curve."""
    norms, about = {}, {}
    for row in work.read(f"{figure}.csv"):
        norms.setdefault(row["curve"], []).append(float(row["l2_norm"]))
        about[row["curve"]] = (row["bpvf"], row["da"])
    return norms, about


def draw(work, figure, norms, colours):
    lines = [Curve(name, list(enumerate(values)), colour, dots=False) for (name, values), colour in zip(norms.items(), colours)]
    work.draw(f"{figure}.svg", draw_curves(f"{figure.replace('-', ' ')}: {CLIP}, error of each frame", "lower is better", Axis("frame"),
                                           Axis("L2 norm, world units", True), lines))


def better(a, b):
    """Share of frames where a has less error, percent."""
    return 100 * mean([x < y for x, y in zip(a, b)])


def section(work, figure, shows, pairs, colours):
    norms, about = series(work, figure)
    if not norms:
        return None
    draw(work, figure, norms, colours)
    checks = [Check(f"{a} has less error than {b}", "yes", f"mean {number(mean(norms[a]))} against {number(mean(norms[b]))}, in "
                    f"{better(norms[a], norms[b]):.0f} % of the frames", holds(mean(norms[a]) < mean(norms[b]))) for a, b in pairs]
    notes = [table(["curve", "bpvf", "da", "mean L2", "largest L2"],
                   [[name, *about[name], number(mean(values)), number(max(values))] for name, values in norms.items()])]
    return Section(shows, checks, [f"{figure}.svg", f"{figure}.csv"], notes)


ITEMS = [
    Item("figure-8.11", "Figure 8.11: error of each frame, LPCA, RLPCA and ORLPCA", measure_8_11,
         lambda work: section(work, "figure-8.11", "Chicken, 10 clusters, 12 bits, all three at the rate of RLPCA with 10 components "
                              "(LPCA in the world with as many components as come nearest to it). The L2 norm is sqrt(V) times the "
                              "frame's rmse.", [("RLPCA", "LPCA"), ("ORLPCA", "RLPCA")], COLOURS.values())),
    Item("figure-8.12", "Figure 8.12: error of each frame by clusters and components", measure_8_12,
         lambda work: section(work, "figure-8.12", "Chicken, RLPCA, 12 bits; the L2 norm is sqrt(V) times the frame's rmse.",
                              [("N 20, L 20", "N 20, L 10"), ("N 20, L 10", "N 10, L 10")], ("#0072b2", "#d55e00", "#e69f00"))),
]
