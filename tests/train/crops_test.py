#!/usr/bin/python3
"""Trainers of kpcn and of the printed network: what they see of frames, that they learn, are stored, and go on.

    crops_test.py BIN_DIR SOURCE_DIR
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import paths

paths.need('numpy', 'torch')
import numpy as np  # noqa: E402
import torch  # noqa: E402

import crops  # noqa: E402
import kpcn  # noqa: E402
import printed  # noqa: E402
import tza  # noqa: E402

INPUTS = ['noise', 'count', 'albedo.R', 'albedo.G', 'albedo.B', 'N.X', 'N.Y', 'N.Z']
EXTRAS = ['color_variance', 'albedo_variance', 'normal_variance', 'depth', 'depth_variance']
CANDIDATES = ['none', 'bilateral']

torch.set_num_threads(1)  # several wait for each other where cores are shared


def write_scene(folder, seed, rng, side=32, extras=EXTRAS):
    """A surface of two albedos, half of it in shadow, and 4 samples a pixel."""
    scale = 2.0
    light = rng.uniform(0.3, 1) * np.where(np.arange(side) < rng.integers(8, 24), 0.2, 1.0)[:, None]
    albedo = np.where(np.arange(side) < rng.integers(8, 24), 0.2, 0.8) * np.ones((3, side, 1))
    truth = light * albedo
    noisy = truth * (1 + 0.4 * rng.normal(size=truth.shape))
    variance = ((0.4 * truth) ** 2).mean(0)
    normal = np.zeros_like(truth)
    normal[2] = 1
    inputs = np.concatenate([0 * truth[:1], 0 * truth[:1] + np.log2(5) / 8, albedo, normal])
    zero = np.zeros((side, side))
    values = {'color_variance': variance, 'albedo_variance': zero, 'normal_variance': zero + 1e-4,
              'depth': zero + 0.5, 'depth_variance': zero}
    base = os.path.join(folder, '%06d' % seed)
    np.save(base + '.inputs.npy', inputs[None].astype(np.float16))
    np.save(base + '.candidates.npy', (np.concatenate([noisy, truth * 1.05])[None] * scale).astype(np.float16))
    np.save(base + '.reference.npy', (np.concatenate([truth, 0 * truth]) * scale).astype(np.float16))
    record = {'seed': seed, 'layout': 'edge', 'size': side, 'scale': scale, 'inputs': INPUTS, 'candidates': CANDIDATES,
              'frames': [{'mean_spp': 4.0}]}
    if extras:
        np.save(base + '.extras.npy', np.stack([values[n] for n in extras])[None].astype(np.float32))
        record['extras'] = extras
    with open(base + '.json', 'w') as out:
        json.dump(record, out)
    return truth, noisy, variance


class CropsTest(unittest.TestCase):
    def setUp(self):
        self.place = tempfile.TemporaryDirectory()
        self.addCleanup(self.place.cleanup)
        self.folder = os.path.join(self.place.name, 'shards')
        os.mkdir(self.folder)

    def write(self, scenes=10):
        rng = np.random.default_rng(3)
        return [write_scene(self.folder, seed, rng) for seed in range(1, scenes + 1)]

    def test_planes_are_in_radiance(self):
        truth, noisy, variance = self.write()[9]
        frames = crops.Frames(self.folder, True, 'cpu', judged=True)
        planes, reference = frames.whole(0)
        np.testing.assert_allclose(crops.part(planes, 'color')[0], noisy, rtol=2e-3)
        np.testing.assert_allclose(crops.part(planes, 'color_variance')[0, 0], variance, rtol=1e-5)
        np.testing.assert_allclose(reference[0, :3], truth, rtol=2e-3)
        self.assertEqual(float(crops.part(planes, 'depth').min()), 0.5)
        self.assertAlmostEqual(float(crops.part(planes, 'count').mean()), np.log2(5) / 8, 3)
        self.assertEqual(len(crops.Frames(self.folder, False, 'cpu')), 9)
        self.assertLess(frames.candidates[0]['bilateral'], frames.candidates[0]['none'])

    def test_crops_keep_what_belongs_together(self):
        self.write()
        frames = crops.Frames(self.folder, False, 'cpu')
        planes, reference = frames.crops(np.random.default_rng(5), 40, 16)
        light = reference / crops.part(planes, 'albedo')
        spread = light.amax(1) / light.amin(1)
        self.assertLess(float(spread.max()), 1.01)  # colours go with albedo, and stay in their place
        self.assertLess(len(np.unique(light.mean(1)[0].numpy().round(2))), 6)
        relative = crops.part(planes, 'color_variance')[:, 0] / (0.4 * reference).square().mean(1)
        np.testing.assert_allclose(relative, np.ones(relative.shape), rtol=1e-2)
        facing = crops.part(planes, 'N').abs()
        self.assertEqual(sorted(float(n) for n in facing[:, :, 0, 0].sum(0) > 0), [1, 1, 1])
        np.testing.assert_allclose(facing.sum(1), np.ones(relative.shape))

    def test_kernels_take_from_where_they_point(self):
        image = torch.rand(1, 3, 9, 12)
        logits = torch.zeros(1, 25, 9, 12)
        logits[:, 5 * 1 + 4] = 200  # one up, two to the right
        moved = kpcn.apply_kernels(logits, image, 2)
        torch.testing.assert_close(moved[..., 1:, :-2], image[..., :-1, 2:])
        torch.testing.assert_close(moved[..., 0, :-2], image[..., 1, 2:])  # mirrored
        torch.testing.assert_close(moved[..., 1:, -1], image[..., :-1, -3])

    def test_narrow_sigmas_keep_the_image_and_wide_ones_blur_it(self):
        self.write()
        planes, _ = crops.Frames(self.folder, True, 'cpu').whole(0)
        color = crops.part(planes, 'color')
        sigmas = torch.full((1, 5, 32, 32), 0.01)
        torch.testing.assert_close(printed.filtered(planes, sigmas), color)
        wide = printed.filtered(planes, torch.full((1, 5, 32, 32), 1e4))
        self.assertAlmostEqual(float(wide[0, 0, 16, 16]), float(color[0, 0, 8:25, 8:25].mean()), 4)

    def learn(self, model):
        """MrSE over the noisy image's, before and after."""
        self.write()
        held_out = crops.Frames(self.folder, True, 'cpu', judged=True)
        before = crops.judge(model, held_out)['over none']
        crops.train(model, argparse.Namespace(
            data=self.folder, out=os.path.join(self.place.name, 'a.tza'), steps=80, seconds=None, batch=4, crop=24,
            rate=5e-3, seed=1, state=None))
        return before, crops.judge(model, held_out)['over none']

    def test_kernels_learn_to_stop_at_edges(self):
        torch.manual_seed(2)
        with unittest.mock.patch.dict(kpcn.SIZES, tiny=(3, 3, 8, 2)):
            before, after = self.learn(kpcn.Kpcn('tiny'))
        self.assertLess(after, 0.8 * before)

    def test_sigmas_learn_to_stop_at_edges(self):
        torch.manual_seed(2)
        before, after = self.learn(printed.Printed(3, 8))
        self.assertLess(after, 0.8 * before)

    def train(self, program, *more):
        out = os.path.join(self.place.name, program + '.tza')
        done = subprocess.run(
            [sys.executable, os.path.join(paths.SOURCE, 'train', program + '.py'), '--data', self.folder, '--out', out,
             '--batch', '2', '--crop', '24', '--state', out + '.state', *more],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=500, env=dict(os.environ, OMP_NUM_THREADS='1'))
        self.assertEqual(done.returncode, 0, done.stdout.decode())
        with open(out[:-4] + '.json') as source:
            return tza.read(out), json.load(source)['curve']

    def test_printed_is_stored_and_goes_on(self):
        self.write()
        weights, curve = self.train('printed', '--layers', '3', '--width', '8', '--steps', '12')
        self.assertEqual([weights['conv%d.weight' % i].shape[:2] for i in range(3)], [(8, 16), (8, 8), (5, 8)])
        self.assertEqual([r['step'] for r in curve], [2, 4, 6, 8, 10, 12])
        again = self.train('printed', '--layers', '3', '--width', '8', '--steps', '18')[1]
        self.assertEqual(again[:len(curve)], curve)
        self.assertEqual([r['step'] for r in again[len(curve):]], [15, 18])

    def test_kpcn_is_stored(self):
        self.write()
        weights, curve = self.train('kpcn', '--steps', '1')
        self.assertEqual(weights['conv4.weight'].shape, (169, 32, 5, 5))
        self.assertEqual(weights['conv0.weight'].shape, (32, 34, 5, 5))
        self.assertEqual(set(curve[-1]['held_out']), {'MrSE', 'over none', 'over bilateral'})

    def test_frames_without_variances_are_refused(self):
        write_scene(self.folder, 1, np.random.default_rng(1), extras=None)
        with self.assertRaisesRegex(SystemExit, '--extras'):
            crops.Frames(self.folder, False, 'cpu')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
