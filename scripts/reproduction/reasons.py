"""Why an item is met, beaten or not: text of the page, by item, written by those who looked at the figures."""

REASONS = {
    "table-4.1":
        "The thesis measured on an Athlon XP 3000+. Adaptive clustering here computes a column of deviations block by block, "
        "only until all vertices of the block are better off elsewhere; clustering is a vectorised kernel, so that with few "
        "clusters it is faster than growing regions, which goes vertex by vertex over the mesh "
        "([SEGMENTATION.md](SEGMENTATION.md)). The elephant here is elephant_gallop, of the same 42,321 vertices and 48 frames.",
    "table-8.2":
        "HOPE gains more here on scanned meshes, because the vertices fitted to are gathered nearest first, and less on "
        "fandisk; the head is the mannequin. random and feline are not to be had, and the dino that is to be had is another "
        "mesh. The sphere is an icosphere whose traversal differs from the thesis': its tangential bits are larger.",
    "table-8.3":
        "As with table 8.2.",
    "table-8.4":
        "HOPE alone does not reach the thesis' icosphere (4.23 bits), because its multi-way prediction pays more for the "
        "tangential part there; `auto` comes to 4.24.",
    "table-8.5":
        "HOPI with the thesis' 8 vertices has more unknowns than points; we take the quadric next to the reference plane, which"
        " is no good predictor on smooth meshes. With 48 vertices it is the best on fandisk.",
    "table-8.6":
        "The cow's second row is printed with L 20 as the first one is; its rate and error are those of L 10, with which it was"
        " run. At the thesis' N and L our bits are 0.54 to 0.8 of the printed ones, and the error is larger in three rows; on "
        "what the thesis' coder spends the difference, its text does not let one find out. What decides is the rate at the "
        "printed error, which is smaller in every row.",
    "figure-8.3-8.6":
        "The optimum is flat: between the thesis' place and ours lie a few hundredths of a bit. Fit vertices are gathered "
        "nearest first, which favours fewer of them and steeper weights.",
    "figure-8.7":
        "At 8 and 9 bits a prediction in local coordinates carries the rounding of two frames, and residuals are coded in "
        "contexts by what is nearby, which helps the weaker predictors more than the thesis' coder did.",
    "figure-8.8":
        "As with figure 8.7.",
    "figure-8.9":
        "The baselines have this program's entropy coder with its contexts, which none of the sources had: they are smaller "
        "here than as published ([BASELINES.md](BASELINES.md)). PCA, KG and CPCA gain most by that, as their bases and "
        "coefficients are coded in contexts, so that SplitCoder in the thesis' mode falls behind them at coarse errors; with "
        "`fitted` it is smaller than all of them. AWC is a wavelet coder over the mesh; the baseline is the lifting along time "
        "(TLS) with prediction over the mesh, and stands for both.",
    "figure-8.10":
        "As with figure 8.9 for the baselines; CPCA is far smaller here than table 8.6 prints it, two to seven times smaller "
        "than SplitCoder at equal da. Gains over the predictive baselines are larger than stated but at coarse steps, where "
        "the local frames carry the rounding of their triangles.",
    "figure-8.11":
        "A cluster's own frame takes its rigid motion away, so that as many components have less to describe; ORLPCA gives "
        "components to the clusters that need them.",
    "figure-8.12":
        "More components and more clusters both leave less.",
    "figure-8.14":
        "As with figure 8.9 for the baselines.",
    "figure-8.15":
        "As with figure 8.9 for the baselines. Samba stands for the dolphin: a dressed dancer, whose every part bends, so that "
        "clusters are less rigid; wavelets along time, which need none, do better there.",
    "figure-8.16":
        "What is left out is the smallest of what is left, and more clusters are each nearer to rigid.",
    "figure-8.22":
        "On the chicken 25 clusters do nearly what 40 do, and the frames of 40 are 0.53 of its bpvf.",
    "figure-8.23":
        "Without the dolphin there is no picture to hold ours against.",
    "figure-8.17":
        "Coefficients that are nothing in steps cost next to nothing, so that the rate hardly falls until half are zeroed. More "
        "clusters give less while coefficients make the rate; where a twentieth of them is left, the frames of the clusters do.",
    "figure-8.20":
        "As with figure 8.9 for the baselines. The wavelet baseline predicts its levels over the mesh, without which its streams "
        "are up to three times as large: that is what the stated 95 % over TLS lack here.",
    "figure-8.21":
        "As with figures 8.9 and 8.15 for the baselines. The best mode, along time and with allocation, is smaller than all.",
    "figure-8.24":
        "Samba stands for the snake. The curves are of 10 and 20 clusters.",
    "figure-8.25":
        "See section 8.8.",
    "figure-8.26":
        "See section 8.8.",
    "section-8.8":
        "In the thesis' modes what it states holds, but for three things. ORLPCA's gain over RLPCA comes close to 42 % and does "
        "not reach it; RLPCA's gain over PDCT on the chicken is as large as stated at some errors, not on the mean; and the "
        "methods do not come close to each other at high rates: a fixed number of components leaves a residue that only more "
        "components remove, while a bit of SplitCoder halves every error, so that RLPCA leads at coarse errors and falls behind "
        "at fine ones. In our best modes the order changes, because SplitCoder's `fitted` and PDCT's allocation over time gain "
        "more over the thesis' modes than rigid clusters do for RLPCA, and ORLPCA's gain is small where both may choose bits and "
        "clusters.",
}


def why(name):
    return REASONS.get(name, "")
