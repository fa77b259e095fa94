"""Computes the criterion of `hapdef select --json` again with scikit-learn.

    hapdef design --out DIR
    python3 benches/sklearn_criterion.py small DIR/dataset.npz D.npz 60 800
    hapdef select --data D.npz --sensors 4 --json > choice.json
    python3 benches/sklearn_criterion.py D.npz choice.json

The second line takes 60 sites and 800 touches evenly from a larger dataset.

Needs numpy and scikit-learn. Standardization over all touches, folds as in `fold_of_touch`, three SVRs a
fold, mean over folds of the mean Euclidean error (mm). For every step it also tries all other sites and
says how much better the best of them is (slow: take a small dataset, or --no-others).
"""

import json
import sys

import numpy as np
from sklearn.svm import SVR


def criterion(z, p_mm, fold, sites, settings):
    errors = []
    for f in range(fold.max() + 1):
        train, test = fold != f, fold == f
        axes = []
        for axis in range(3):
            model = SVR(
                C=settings["c_mm"],
                epsilon=settings["epsilon_mm"],
                gamma=settings["gamma"],
                tol=settings["tolerance_mm"],
                cache_size=2000,
            )
            model.fit(z[sites][:, train].T, p_mm[train, axis])
            axes.append(model.predict(z[sites][:, test].T))
        errors.append(np.linalg.norm(np.stack(axes, 1) - p_mm[test], axis=1).mean())
    return float(np.mean(errors))


def small(source, target, sites, touches):
    data = np.load(source)
    x = data["X"]
    varying = np.flatnonzero(x.std(1) > 0)
    rows = varying[np.linspace(0, len(varying) - 1, sites).round().astype(int)]
    columns = np.linspace(0, x.shape[1] - 1, touches).round().astype(int)
    np.savez(target, X=x[np.ix_(rows, columns)], p_m=data["p_m"][columns], site_m=data["site_m"][rows])


def main():
    if sys.argv[1] == "small":
        return small(sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5]))
    data = np.load(sys.argv[1])
    choice = json.load(open(sys.argv[2]))
    others_too = "--no-others" not in sys.argv
    x, p_mm = data["X"].astype(float), data["p_m"] * 1e3
    deviation = x.std(1, keepdims=True)
    z = (x - x.mean(1, keepdims=True)) / np.where(deviation > 0, deviation, 1)
    fold = np.array(choice["fold_of_touch"])
    settings = choice["criterion"]
    for step in choice["steps"]:
        sites = step["sites"]
        own = criterion(z, p_mm, fold, sites, settings)
        theirs = step["criterion_mm"]
        line = f"{len(sites)} gauges: hapdef {theirs:.4f} mm, scikit-learn {own:.4f} mm ({100 * (theirs / own - 1):+.3f} %)"
        if others_too and choice["selector"] == "greedy-svr":
            rest = [s for s in range(len(x)) if s not in sites and deviation[s] > 0]
            best = min(criterion(z, p_mm, fold, sites[:-1] + [s], settings) for s in rest)
            line += f", best of the {len(rest)} others {best:.4f} ({100 * (own / best - 1):+.2f} %)"
        print(line, flush=True)


if __name__ == "__main__":
    main()
