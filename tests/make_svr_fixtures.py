#!/usr/bin/env python3
"""Makes tests/fixtures/svr.json: what LIBSVM (through scikit-learn) finds on small problems.

    pip install numpy scikit-learn && python3 tests/make_svr_fixtures.py
"""

import json
import pathlib

import numpy
import sklearn
from sklearn.svm import SVR

problems = []
rng = numpy.random.default_rng(20261121)
settings = [
    # touches, features, C, epsilon, gamma, size of the target
    (60, 1, 1.0, 0.1, 0.5, 1.0),
    (120, 3, 20.0, 1e-3, 0.1, 1.0),
    (150, 5, 200.0, 0.1, 0.1, 50.0),
    (150, 10, 2000.0, 1.0, 0.02, 50.0),
    (100, 4, 20.0, 1e-6, 2e-3, 0.05),  # the paper's: targets in metres
    (90, 2, 0.1, 1e-4, 2e-3, 0.05),
    (80, 2, 5.0, 0.05, 5.0, 1.0),
]
for touches, features, c, epsilon, gamma, size in settings:
    x = rng.normal(size=(touches, features))
    weights = rng.normal(size=features)
    y = size * (numpy.sin(x @ weights) + 0.3 * x[:, 0] + 0.05 * rng.normal(size=touches))
    unseen = rng.normal(size=(12, features))
    model = SVR(kernel="rbf", C=c, epsilon=epsilon, gamma=gamma, tol=1e-10 * size, cache_size=200).fit(x, y)
    beta = numpy.zeros(touches)
    beta[model.support_] = model.dual_coef_[0]
    kernel = numpy.exp(-gamma * ((x[:, None, :] - x[None, :, :]) ** 2).sum(-1))
    objective = 0.5 * beta @ kernel @ beta - y @ beta + epsilon * numpy.abs(beta).sum()
    problems.append(
        {
            "c": c,
            "epsilon": epsilon,
            "gamma": gamma,
            "size": size,
            "x": x.T.tolist(),
            "y": y.tolist(),
            "unseen": unseen.T.tolist(),
            "objective": float(objective),
            "predictions": model.predict(unseen).tolist(),
        }
    )

# Many random problems, of which only the optimum is kept: tests/libsvm.rs draws the same ones.
MASK = (1 << 64) - 1


class Draw:
    """Splitmix64 (S. Vigna), the same in Rust."""

    def __init__(self, seed):
        self.state = seed

    def word(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        return z ^ (z >> 31)

    def unit(self):
        """In [-1, 1)."""
        return (self.word() >> 11) * 2.0**-52 - 1.0

    def one_of(self, values):
        return values[self.word() % len(values)]


def random_problem(seed):
    draw = Draw(seed)
    touches, features = 20 + draw.word() % 120, 1 + draw.word() % 12
    size = draw.one_of([0.05, 1.0, 50.0])
    c = size * draw.one_of([0.1, 1.0, 20.0, 400.0])
    epsilon = size * draw.one_of([0.0, 1e-6, 2e-3, 0.05, 0.3])
    gamma = draw.one_of([2e-3, 0.02, 0.1, 0.5, 3.0])
    x = numpy.array([[draw.unit() for _ in range(touches)] for _ in range(features)]) * 1.7
    weights = [draw.unit() for _ in range(features)]
    y = numpy.array([sum(w * v for w, v in zip(weights, x[:, t])) + 0.2 * draw.unit() for t in range(touches)])
    return x, size * (y + 0.5 * y * y), c, epsilon, gamma, size


objectives = []
for seed in range(200):
    x, y, c, epsilon, gamma, size = random_problem(seed)
    model = SVR(kernel="rbf", C=c, epsilon=epsilon, gamma=gamma, tol=1e-8 * size, cache_size=200).fit(x.T, y)
    beta = numpy.zeros(len(y))
    beta[model.support_] = model.dual_coef_[0]
    kernel = numpy.exp(-gamma * ((x.T[:, None, :] - x.T[None, :, :]) ** 2).sum(-1))
    objectives.append(float(0.5 * beta @ kernel @ beta - y @ beta + epsilon * numpy.abs(beta).sum()))

target = pathlib.Path(__file__).parent / "fixtures" / "svr.json"
target.write_text(json.dumps({"made_with": f"scikit-learn {sklearn.__version__}", "problems": problems, "random": objectives}))
print(f"wrote {target} with scikit-learn {sklearn.__version__}")
