# SPDX-License-Identifier: Apache-2.0
"""The solvers of SciPy take a scene as it is."""

import numpy as np
from scipy.optimize import lsq_linear, minimize
from scipy.sparse.linalg import eigsh, gmres, lsqr, svds

import symrig


def test_lsqr_inverts_the_transport(groove):
    light = symrig.light("letters", groove.light_shape)
    wanted = groove @ light
    found, reason, iterations, norm = lsqr(groove, wanted.ravel(), atol=1e-6, btol=1e-6)[:4]
    assert reason in (1, 2) and iterations < 300
    # What lsqr says of the residual is what the product gives. Both are float sums, as wanted is.
    residual = np.linalg.norm(groove @ found.astype(np.float32).reshape(light.shape) - wanted)
    assert abs(residual - norm) <= 1e-5 * np.linalg.norm(wanted)
    assert np.abs(found - light.ravel()).max() < 0.02


def misfit(scene, wanted):
    """Half the squared distance to the wanted picture, and its gradient."""

    def value_and_slope(light):
        rest = scene @ light - wanted
        return 0.5 * float(rest @ rest), (scene.T @ rest).astype(float)

    return value_and_slope


def test_a_bounded_light_is_as_good_as_the_dense_solution():
    """Compensation: the projector has light from 0 to 1 only."""
    groove = symrig.capture("sim:vgroove-textured?size=16x12", polish=0)
    wanted = (0.3 * symrig.light("letters", groove.photo_shape) + 0.02).ravel()
    found = minimize(misfit(groove, wanted), np.full(groove.shape[1], 0.5), jac=True, method="L-BFGS-B", bounds=[(0, 1)] * groove.shape[1])
    assert found.x.min() >= 0 and found.x.max() <= 1
    matrix = groove.to_numpy().astype(float)
    best = lsq_linear(matrix, wanted, bounds=(0, 1), method="bvls", tol=1e-10)
    assert np.linalg.norm(matrix @ found.x - wanted) <= 1.001 * np.linalg.norm(matrix @ best.x - wanted)
    clipped = np.clip(lsqr(groove, wanted)[0], 0, 1)
    assert np.linalg.norm(groove @ found.x - wanted) < np.linalg.norm(groove @ clipped - wanted)


def applications_to(scene, wanted, share, scale):
    """Products with T and its transpose until the residual is this share of the picture; None: not within 50."""
    count, reached = 0, None

    def value_and_slope(light):
        nonlocal count, reached
        count += 2
        value, slope = misfit(scene, wanted)((light / scale).astype(np.float32))
        if reached is None and np.sqrt(2 * value) <= share * np.linalg.norm(wanted):
            reached = count
        return value, slope / scale

    bounds = [(0, most) for most in scale]
    minimize(value_and_slope, 0.5 * scale, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxfun": 25, "ftol": 0, "gtol": 0})
    return reached


def test_a_scale_by_the_light_that_a_pixel_sends_saves_most_steps():
    """As `symrig-mpi solve` does it."""
    groove = symrig.capture("sim:vgroove-textured?size=64x64", polish=0)
    wanted = groove @ symrig.light("natural", groove.light_shape).ravel()
    sent = (groove.T @ np.ones(groove.shape[0], np.float32)).astype(float)
    scaled = applications_to(groove, wanted, 0.01, sent)
    unscaled = applications_to(groove, wanted, 0.01, np.ones(groove.shape[1]))
    assert scaled is not None and scaled <= 25
    assert unscaled is None or unscaled > scaled


def test_eigen_lights_and_singular_lights(groove):
    matrix = groove.to_numpy().astype(float)
    wanted = np.sort(np.abs(np.linalg.eigvalsh((matrix + matrix.T) / 2)))[-4:]
    # The matrix is the operator applied to units. Its rounding moves an eigenvalue by at most that of its norm.
    limit = 1e-5 * wanted[-1]
    values, lights = eigsh(groove, k=4)
    assert np.abs(np.sort(np.abs(values)) - wanted).max() < limit
    for value, light in zip(values, lights.T):
        assert np.linalg.norm(groove @ light - value * light) < limit
    assert np.abs(np.sort(svds(groove, k=4)[1]) - wanted).max() < limit


def test_gmres_solves(groove):
    light = np.ones(groove.light_shape, np.float32).ravel()
    found, info = gmres(groove, groove @ light, tol=1e-4, atol=0)
    assert info == 0 and np.linalg.norm(found - light) < 0.05 * np.linalg.norm(light)
