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

target = pathlib.Path(__file__).parent / "fixtures" / "svr.json"
target.write_text(json.dumps({"made_with": f"scikit-learn {sklearn.__version__}", "problems": problems}))
print(f"wrote {target} with scikit-learn {sklearn.__version__}")
