# SPDX-License-Identifier: Apache-2.0
"""
Pipeline of scikit-learn
========================

``WaveletNetworkRegressor`` is an estimator of scikit-learn: it works in pipelines, searches and
cross-validation. This example compares it with a spline on a simulated detent, with the same folds.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import SplineTransformer, StandardScaler

import palpate


# %%
# Eight strokes over a spring with two detents of different width, with a force noise of 0.02 N·m.
def force_of(x):
    return 2 * x - 0.5 * np.exp(-(((x - 0.15) / 0.04) ** 2)) - 0.3 * np.exp(-(((x - 0.4) / 0.012) ** 2))


random = np.random.default_rng(8)
position = np.tile(np.linspace(0.0, 0.5, 250), 8)
force = force_of(position) + random.normal(0.0, 0.02, len(position))
stroke = np.repeat(np.arange(8), 250)
X = position[:, None]

# %%
# Rows of one stroke are adjacent in time and correlated. The folds therefore hold out whole strokes.
folds = GroupKFold(4)
network = make_pipeline(StandardScaler(), palpate.WaveletNetworkRegressor())
spline = GridSearchCV(
    make_pipeline(SplineTransformer(), Ridge(alpha=1e-6)),
    {"splinetransformer__n_knots": [5, 10, 20, 40, 80]},
    cv=5,
)
score = {
    name: cross_val_score(each, X, force, groups=stroke, cv=folds).mean()
    for name, each in (("wavelet network", network), ("tuned spline", spline))
}
for name, value in score.items():
    print(f"{name}: R2 {value:.4f} on held-out strokes")

# %%
# The fitted network chooses its size from the data. The spline needs a search over the number of its knots.
fitted = network.fit(X, force)[-1]
knots = spline.fit(X, force).best_params_["splinetransformer__n_knots"]
x = np.linspace(0.0, 0.5, 1000)
figure, axes = plt.subplots(layout="constrained")
axes.plot(position, force, ".", color="0.8", markersize=2, label="rows")
axes.plot(x, network.predict(x[:, None]), "k", label=f"network, {fitted.n_parameters_} parameters")
axes.plot(x, spline.predict(x[:, None]), "C3--", label=f"spline, {knots + 2} coefficients")
axes.set(xlabel="position [rad]", ylabel="force [N·m]")
axes.legend()

# %%
# Result
# ------
# Both errors are the noise. The network fails to be smaller if all features have one width: equal knots then
# suffice. The estimator has no units, domain or plan; :func:`palpate.identify` gives a model that has them.
r2 = score["wavelet network"]
print(
    f"R2 {r2:.4f} with {fitted.n_wavelets_} wavelets, {fitted.n_parameters_} parameters; spline {knots + 2}"
)
plt.show()
