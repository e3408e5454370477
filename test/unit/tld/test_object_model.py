# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from tld_follower.tld.frame import PATCH_SIZE
from tld_follower.tld.object_model import ObjectModel, Templates, best_products


def patches(count, seed):
    values = np.random.default_rng(seed).standard_normal((count, PATCH_SIZE)).astype(np.float32)
    values -= values.mean(axis=1, keepdims=True)
    return values / np.linalg.norm(values, axis=1, keepdims=True)


@pytest.mark.parametrize("templates", [1, 3, 4, 30])
def test_best_products_match_a_matrix_product(templates):
    a, b = patches(20, 0), patches(templates, 1)
    np.testing.assert_allclose(best_products(a, b), (a @ b.T).max(axis=1), atol=1e-5)
    np.testing.assert_array_equal(best_products(a, b[:0]), -1.0)


def test_similarities_are_the_published_ones():
    model = ObjectModel(10, 10)
    positives, negatives, tested = patches(4, 0), patches(3, 1), patches(5, 2)
    for patch in positives:
        model.positives.add(patch)
    for patch in negatives:
        model.negatives.add(patch)
    similar = 0.5 * (tested @ positives.T + 1)
    positive, early = similar.max(axis=1), similar[:, :2].max(axis=1)
    negative = (0.5 * (tested @ negatives.T + 1)).max(axis=1)
    result = model.similarity(tested)
    np.testing.assert_allclose(result.positive, positive, atol=1e-5)
    np.testing.assert_allclose(result.relative, (1 - negative) / (2 - negative - positive), atol=1e-5)
    np.testing.assert_allclose(result.conservative, (1 - negative) / (2 - negative - early), atol=1e-5)
    np.testing.assert_allclose(model.positive_similarity(tested), positive, atol=1e-5)


def test_a_model_without_negatives_compares():
    model = ObjectModel(10, 10)
    model.positives.add(patches(1, 0)[0])
    assert model.similarity(patches(1, 0)).relative[0] == pytest.approx(1.0, abs=1e-3)
    unlike = model.similarity(-patches(1, 0))
    assert 0.0 <= unlike.relative[0] <= 0.5
    assert np.isfinite(unlike.conservative).all()


def test_what_is_both_target_and_background_is_undecided():
    model = ObjectModel(10, 10)
    model.positives.add(patches(1, 0)[0])
    model.negatives.add(patches(1, 0)[0])
    assert 0.3 < model.similarity(patches(1, 0)).relative[0] < 0.7


class TestTemplates:
    def test_the_first_stays_and_time_keeps_its_order(self):
        templates = Templates(5, protected=1)
        every = patches(30, 3)
        for patch in every:
            templates.add(patch)
        assert len(templates) == 5
        kept = [int(np.argmax(every @ patch)) for patch in templates.patches]
        assert kept[0] == 0
        assert kept == sorted(kept)

    def test_the_redundant_goes(self):
        templates = Templates(4, protected=1)
        different = patches(4, 4)
        for patch in different:
            templates.add(patch)
        twin = different[2] + 0.01 * different[1]
        templates.add(twin / np.linalg.norm(twin))
        products = templates.patches @ templates.patches.T
        assert len(templates) == 4
        assert np.abs(products - np.eye(4)).max() < 0.5

    def test_what_stays_is_what_a_search_of_all_pairs_leaves(self):
        rng = np.random.default_rng(6)
        seeds = patches(12, 7)
        every = seeds[rng.integers(0, 12, 60)] + 0.05 * rng.standard_normal((60, PATCH_SIZE)).astype(
            np.float32
        )
        every /= np.linalg.norm(every, axis=1, keepdims=True)
        templates, kept = Templates(9, protected=1), []
        for index, patch in enumerate(every):
            templates.add(patch)
            kept.append(index)
            if len(kept) > 9:
                products = every[kept] @ every[kept].T - 9.0 * np.eye(len(kept), dtype=np.float32)
                # Two are equally near to each other: the older one goes.
                del kept[1 + int(np.argmax(np.round(products.max(axis=1)[1:], 5)))]
            np.testing.assert_array_equal(templates.patches, every[kept])

    def test_a_cap_of_one_keeps_the_first(self):
        templates = Templates(1, protected=1)
        for patch in patches(3, 5):
            templates.add(patch)
        np.testing.assert_array_equal(templates.patches, patches(3, 5)[:1])
