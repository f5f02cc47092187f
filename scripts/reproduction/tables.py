"""Tables 4.1, 8.2 to 8.5 and 8.6, and figures 8.3 to 8.6."""
import sys

import curves
import plot_static
from rd_runs import encode
from reproduction import thesis
from reproduction.work import (MET, NOT, NOT_MEASURED, OPEN, Check, Item, Section, at_least, at_most, holds, number, table)

SEGMENTATIONS = ("region-growing", "clustering", "adaptive")
MESH_FILES = {"sphere": "sphere", "horse": "horse.off", "mannequin": "mannequin.off", "dino": "dino.off", "fandisk": "fandisk.obj",
              "cow": "cow.off", "camelhead": "camelhead.off", "stanford-bunny": "stanford-bunny.obj"}
FIGURE_MESHES = ("cow", "horse", "mannequin", "dino", "fandisk", "sphere")


# Table 4.1

def measure_4_1(work):
    clips = [clip for clip in thesis.TABLE_4_1 if clip in work.clips]
    return work.bench_table("segmentation_table.csv", "clip", clips,
                            lambda clip: ["batchenc_segmentation_table", "--threads", "1", work.clips[clip]])


def report_4_1(work):
    measured = {(row["clip"], int(row["asked"]), row["method"]): float(row["time_s"]) for row in work.read("segmentation_table.csv")}
    rows, checks, shares = [], [], []
    for clip, by_count in thesis.TABLE_4_1.items():
        for count, seconds in by_count.items():
            for method, printed in zip(SEGMENTATIONS, seconds):
                ours = measured.get((clip, count, method))
                rows.append({"clip": clip, "clusters": count, "method": method, "thesis_s": printed, "time_s": number(ours)})
                if ours is not None:
                    checks.append(Check(f"{clip}, N {count}, {method}", f"{printed} s", f"{ours:.3g} s", at_most(ours, printed)))
                    shares.append(printed / ours)
                elif method == SEGMENTATIONS[0] and count == 5:
                    checks.append(Check(clip, "printed", thesis.NO_CLIP, OPEN))
    if not shares:
        return None
    work.write("table-4.1.csv", rows)
    shown = [[clip, count, *(f"{p:g} / {number(measured.get((clip, count, m)))}" for m, p in zip(SEGMENTATIONS, seconds))]
             for clip, by_count in thesis.TABLE_4_1.items() for count, seconds in by_count.items()
             if (clip, count, SEGMENTATIONS[0]) in measured]
    first = [measured[clip, count, "region-growing"] <= min(measured[clip, count, method] for method in SEGMENTATIONS[1:])
             for clip, count, _ in {key for key in measured if key[2] == "rigid" and key[0] in thesis.TABLE_4_1}]
    checks.append(Check("region growing is the fastest", "in all rows", f"in {sum(first)} of {len(first)} rows", holds(all(first))))
    notes = ["Seconds, the thesis' first and ours after it; one thread, the shortest of three:",
             table(["clip", "N", "region growing", "clustering", "adaptive"], shown),
             f"We are {min(shares):,.0f} to {max(shares):,.0f} times faster."]
    return Section("Times of three segmentations for 5 to 40 clusters.", checks, ["table-4.1.csv", "segmentation_table.csv"], notes)


# Static meshes

def mesh_argument(work, name):
    return name if name == "sphere" else work.meshes / MESH_FILES[name]


def measure_static(work):
    if not work.meshes:
        print("left out: tables 8.2 to 8.5 need --meshes FOLDER", file=sys.stderr)
        return 0
    there = [name for name in MESH_FILES if name == "sphere" or mesh_argument(work, name).exists()]
    return work.bench_table("static_table.csv", "mesh", there,
                            lambda name: ["batchenc_static_tables", "table", mesh_argument(work, name)])


def static_rows(work):
    """(mesh, tangential, normal): row."""
    return {(row["mesh"], row["tangential"], row["normal"]): row for row in work.read("static_table.csv")}


def report_angles(number_of_table, tangential, printed):
    def report(work):
        measured, rows, checks = static_rows(work), [], []
        for name, (xy, tg, ho, gain) in printed.items():
            mesh = thesis.MESHES[name]
            ours = [measured.get((mesh, tangential, normal)) for normal in ("touma-gotsman", "hope")]
            if not all(ours):
                checks.append(Check(name, "printed", "mesh not to be had", OPEN))
                continue
            our_xy, our_tg, our_ho = (float(ours[0]["tangential_bits"]), *(float(row["normal_bits"]) for row in ours))
            our_gain = 100 * (1 - our_ho / our_tg)
            rows.append({"mesh": name, "ours": mesh, "thesis_xy": xy, "xy": our_xy, "thesis_tg": tg, "tg": our_tg, "thesis_hope": ho,
                         "hope": our_ho, "thesis_gain": gain, "gain": f"{our_gain:.2f}"})
            checks += [Check(f"{name}: x, y", f"{xy}", f"{our_xy:.2f}", at_most(our_xy, xy)),
                       Check(f"{name}: angle, higher order", f"{ho}", f"{our_ho:.2f}", at_most(our_ho, ho)),
                       Check(f"{name}: gain in the angle", f"{gain} %", f"{our_gain:.1f} %", at_least(our_gain, gain))]
        if not rows:
            return None
        work.write(f"table-{number_of_table}.csv", rows)
        shown = table(["mesh", "x, y: thesis", "ours", "angle, TG: thesis", "ours", "angle, HOPE: thesis", "ours", "gain: thesis", "ours"],
                      [[f"{r['mesh']} ({r['ours']})" if r["ours"] != r["mesh"] else r["mesh"], r["thesis_xy"], f"{r['xy']:.2f}",
                        r["thesis_tg"], f"{r['tg']:.2f}", r["thesis_hope"], f"{r['hope']:.2f}", f"{r['thesis_gain']} %", f"{r['gain']} %"]
                       for r in rows])
        return Section(f"Bits a vertex of tangential components ({tangential} prediction) and bending angle.", checks,
                       [f"table-{number_of_table}.csv", "static_table.csv"], [shown])
    return report


def least_coded(measured, mesh):
    found = [float(row["coded_bits"]) for (name, _, _), row in measured.items() if name == mesh]
    return min(found, default=None)


def report_8_4(work):
    measured, rows, checks = static_rows(work), [], []
    for name, (vertices, _, tg, ours_there, _) in thesis.TABLE_8_4.items():
        mesh = thesis.MESHES[name]
        best, hope = least_coded(measured, mesh), measured.get((mesh, "multiway", "hope"))
        if not hope:
            checks.append(Check(name, f"{ours_there}", "mesh not to be had", OPEN))
            continue
        rows.append({"mesh": name, "ours": mesh, "thesis_vertices": vertices, "vertices": hope["vertices"], "thesis_tg": tg,
                     "thesis_hope": ours_there, "hope": hope["coded_bits"], "best": f"{best:.3f}"})
        checks += [Check(f"{name}: geometry, HOPE", f"{ours_there}", f"{float(hope['coded_bits']):.2f}",
                         at_most(float(hope["coded_bits"]), ours_there)),
                   Check(f"{name}: geometry, our best", f"{min(tg, ours_there)}", f"{best:.2f}", at_most(best, min(tg, ours_there)))]
    if not rows:
        return None
    work.write("table-8.4.csv", rows)
    shown = table(["mesh", "vertices: thesis", "ours", "TG in the thesis", "thesis", "ours, HOPE on multi-way", "ours, best of all"],
                  [[r["mesh"], r["thesis_vertices"], r["vertices"], r["thesis_tg"], r["thesis_hope"], r["hope"], r["best"]] for r in rows])
    return Section("Geometry bits a vertex at 12 bits, every byte of the clip counted; connectivity is in "
                   "[STATIC_MESHES.md](STATIC_MESHES.md#connectivity).", checks, ["table-8.4.csv", "static_table.csv"], [shown])


def report_8_5(work):
    measured, rows, checks = static_rows(work), [], []
    for name, printed in thesis.TABLE_8_5.items():
        mesh = thesis.MESHES[name]
        found = [measured.get((mesh, "multiway", normal)) for normal in ("touma-gotsman", "hope", "hopi", "hops")]
        if not all(found):
            checks.append(Check(name, "printed", "mesh not to be had", OPEN))
            continue
        ours = [float(row["coded_bits"]) for row in found]
        rows.append({"mesh": name, "ours": mesh, **{f"thesis_{key}": p for key, p in zip(("tg", "hope", "hopi", "hops"), printed)},
                     **dict(zip(("tg", "hope", "hopi", "hops"), ours))})
        checks += [Check(f"{name}: {key}", f"{p}", f"{o:.2f}", at_most(o, p)) for key, p, o in
                   zip(("TG", "HOPE", "HOPI", "HOPS"), printed, ours)]
    if not rows:
        return None
    work.write("table-8.5.csv", rows)
    shown = table(["mesh", *(f"{key}: thesis / ours" for key in ("TG", "HOPE", "HOPI", "HOPS"))],
                  [[r["mesh"], *(f"{r[f'thesis_{key}']} / {r[key]:.2f}" for key in ("tg", "hope", "hopi", "hops"))] for r in rows])
    return Section("Geometry bits a vertex by surface fitted to, multi-way prediction, 12 bits.", checks,
                   ["table-8.5.csv", "static_table.csv"], [shown])


# Figures 8.3 to 8.6

def measure_static_figures(work):
    if not work.meshes:
        print("left out: figures 8.3 to 8.6 need --meshes FOLDER", file=sys.stderr)
        return 0
    if not all(name == "sphere" or mesh_argument(work, name).exists() for name in FIGURE_MESHES):
        print("left out: figures 8.3 to 8.6, not all of their meshes are there", file=sys.stderr)
        return 0
    if work.read("static_figures.csv") and not work.again:
        return 0
    return work.bench_table("static_figures.csv", "figure", ["8.3"],
                            lambda _: ["batchenc_static_tables", "figures", *(mesh_argument(work, n) for n in FIGURE_MESHES)])


def report_static_figures(work):
    rows = work.read("static_figures.csv")
    if not rows:
        return None
    plot_static.main(work.output / "static_figures.csv", work.output)
    stated = {"8.3": ("exponent", {"hope": 1.37, "hopi": 2.68}), "8.4": ("vertices", {"hope": 22, "hopi": 8}),
              "8.5": ("cosine", {"hope": 0.67, "hopi": 0.9})}
    checks = []
    for figure, (column, best) in stated.items():
        for predictor, where in best.items():
            mine = [row for row in rows if row["figure"] == figure and row["predictor"] == predictor]
            plain = [float(row["normal_bits"]) for row in rows if row["figure"] == figure and row["predictor"] == "touma-gotsman"]
            if not mine or not plain:
                continue
            least = min(mine, key=lambda row: float(row["normal_bits"]))
            there = min(mine, key=lambda row: abs(float(row[column]) - where))
            above = float(there["normal_bits"]) - float(least["normal_bits"])
            checks.append(Check(f"{figure}: {predictor}, best {column} on the cow", f"{where}",
                                f"{least[column]}; at the thesis' place {above:.2f} bits above that",
                                MET if abs(float(least[column]) - where) <= 0.15 * where else NOT))
            saved = 100 * (1 - float(least["normal_bits"]) / min(plain))
            checks.append(Check(f"{figure}: {predictor} is better than TG at its best", "yes", f"{saved:.0f} % smaller",
                                MET if saved > 0 else NOT))
    return Section("Bits of the bending angle by weighting exponent, number of vertices fitted to, least cosine, and both.", checks,
                   [f"figure-{f}.svg" for f in plot_static.AXES] + ["static_figures.csv"])


# Table 8.6

WANTED_8_6 = [("chicken", 20, 20), ("chicken", 20, 10), ("chicken", 10, 10), ("cowheavy", 30, 20), ("cowheavy", 30, 10),
              ("cowheavy", 10, 10)]


def keys_8_6(count, components):
    return {"codec.method": "rlpca", "segmentation.method": "clustering", "segmentation.clusters": count,
            "codec.components": components, "codec.basis_bits": 12, "codec.coefficient_bits": 12, "codec.frame_bits": 16}


def measure_8_6(work):
    failures = work.run(["chicken", "cowheavy"], ["rlpca-thesis", "rlpca", "baseline-cpca"])
    have = {(row["clip"], row["N"], row["L"]): row for row in ([] if work.again else work.read("timing_8.6.csv"))}
    for index, (clip, count, components) in enumerate(WANTED_8_6, 1):
        if clip not in work.clips or (clip, str(count), str(components)) in have:
            continue
        print(f"table-8.6: {clip} N {count} L {components}, {index} of {len(WANTED_8_6)}", file=sys.stderr, flush=True)
        try:
            runs = [encode(work.program, ["--threads", "1"], work.clips[clip], keys_8_6(count, components)) for _ in range(3)]
        except OSError as error:
            print(f"failed: table-8.6 {clip} N {count} L {components}: {error}", file=sys.stderr)
            failures += 1
            continue
        work.processes += 3
        have[clip, str(count), str(components)] = {
            "clip": clip, "N": str(count), "L": str(components), "bpvf_geometry": f"{runs[0]['bpvf_geometry']:.6g}",
            "da": f"{runs[0]['da']:.6g}", "encode_s": f"{min(r['encode_time_s'] for r in runs):.4g}",
            "decode_s": f"{min(r['decode_time_s'] for r in runs):.4g}"}
        work.write("timing_8.6.csv", list(have.values()))
    return failures


def report_8_6(work):
    have = {(row["clip"], int(row["N"]), int(row["L"])): row for row in work.read("timing_8.6.csv")}
    if not have:
        return None
    rows, checks = [], []
    for clip, cpca_rate, cpca_da, rate, da, count, components, encode_s, decode_s in thesis.TABLE_8_6:
        meant = 10 if (clip, rate) == ("cowheavy", 4.1) else components
        ours = have.get((clip, count, meant))
        name = f"{clip} N {count} L {components}" + (f" (run with {meant})" if meant != components else "")
        if not ours:
            checks.append(Check(name, f"{rate} bpvf at da {da}", thesis.NO_CLIP if clip == "dolphin" else NOT_MEASURED, OPEN))
            continue
        at_da = curves.rate_at(work.curve(clip, "rlpca-thesis"), da)
        best = curves.rate_at(work.curve(clip, "rlpca"), da)
        cpca = curves.rate_at(work.curve(clip, "baseline-cpca"), cpca_da)
        rows.append({"clip": clip, "N": count, "L": components, "L_run": meant, "thesis_bpvf": rate, "bpvf_geometry": ours["bpvf_geometry"],
                     "thesis_da": da, "da": ours["da"], "bpvf_at_thesis_da": number(at_da), "best_mode_at_thesis_da": number(best),
                     "thesis_encode_s": encode_s, "encode_s": ours["encode_s"], "thesis_decode_s": decode_s, "decode_s": ours["decode_s"],
                     "cpca_thesis_bpvf": cpca_rate, "cpca_da": cpca_da, "cpca_ours_bpvf": number(cpca)})
        checks += [Check(f"{name}: bpvf", f"{rate}", number(ours["bpvf_geometry"]), at_most(float(ours["bpvf_geometry"]), rate)),
                   Check(f"{name}: da", f"{da}", number(ours["da"]), at_most(float(ours["da"]), da)),
                   Check(f"{name}: bpvf at its da, N and L free", f"{rate}", number(at_da) or "beyond our curve", at_most(at_da, rate)),
                   Check(f"{name}: seconds, encoding", f"{encode_s}", ours["encode_s"], at_most(float(ours["encode_s"]), encode_s)),
                   Check(f"{name}: seconds, decoding", f"{decode_s}", ours["decode_s"], at_most(float(ours["decode_s"]), decode_s)),
                   Check(f"{name}: CPCA, bpvf at da {cpca_da}", f"{cpca_rate}", number(cpca) or (
                       "beyond our curve" if work.curve(clip, "baseline-cpca") else NOT_MEASURED), at_most(cpca, cpca_rate))]
    if not rows:
        return None
    work.write("table-8.6.csv", rows)
    shown = table(["clip", "N", "L", "bpvf: thesis / ours", "da: thesis / ours", "bpvf at the thesis' da", "the same, rigid clusters, any bits",
                   "encoding, s", "decoding, s", "CPCA: thesis / ours at its da"],
                  [[r["clip"], r["N"], r["L"] if r["L"] == r["L_run"] else f"{r['L']} (run with {r['L_run']})",
                    f"{r['thesis_bpvf']} / {number(r['bpvf_geometry'])}", f"{r['thesis_da']} / {number(r['da'])}", r["bpvf_at_thesis_da"],
                    r["best_mode_at_thesis_da"], f"{r['thesis_encode_s']} / {r['encode_s']}", f"{r['thesis_decode_s']} / {r['decode_s']}",
                    f"{r['cpca_thesis_bpvf']} / {r['cpca_ours_bpvf']}"] for r in rows])
    return Section("RLPCA at the thesis' clusters and components, 12, 12 and 16 bits, beside CPCA; rates of the geometry.", checks,
                   ["table-8.6.csv", "timing_8.6.csv", "thesis_modes.csv"], [shown])


ITEMS = [
    Item("table-4.1", "Table 4.1: times of segmentation", measure_4_1, report_4_1),
    Item("table-8.2", "Table 8.2: tangential components and bending angle, parallelogram", measure_static,
         report_angles("8.2", "parallelogram", thesis.TABLE_8_2)),
    Item("table-8.3", "Table 8.3: tangential components and bending angle, multi-way", measure_static,
         report_angles("8.3", "multiway", thesis.TABLE_8_3)),
    Item("table-8.4", "Table 8.4: geometry of static meshes", measure_static, report_8_4),
    Item("table-8.5", "Table 8.5: geometry by fitted surface", measure_static, report_8_5),
    Item("table-8.6", "Table 8.6: RLPCA against CPCA, rates and times", measure_8_6, report_8_6),
    Item("figure-8.3-8.6", "Figures 8.3 to 8.6: what surfaces are fitted to", measure_static_figures, report_static_figures),
]
