#!/usr/bin/python3
"""TZA files, softmax over what is there, turned crops, and a training that learns and goes on.

    network_test.py BIN_DIR SOURCE_DIR
"""
import json
import os
import struct
import sys
import tempfile
import unittest

import paths

paths.need('numpy', 'torch')
import numpy as np  # noqa: E402
import torch  # noqa: E402

import model  # noqa: E402
import shards  # noqa: E402
import train  # noqa: E402
import tza  # noqa: E402

SLOTS = ['none', 'bilateral', 'rd', 'oidn']
NAMES = ['count', 'albedo.R', 'albedo.G', 'albedo.B'] + [s + '.' + c for s in SLOTS for c in 'RGB'] + ['rd.error']
SMALL = {'encoder': [8, 8], 'decoder': [8], 'batch': 4, 'crop': 24, 'rate': 5e-3}


def write_scene(folder, seed, rng, have=4, side=32):
    """Flat truth with an edge; rd is right, none is noisy, the others are biased."""
    truth = np.ones((3, side, side)) * rng.uniform(0.5, 2)
    truth[:, :, side // 2:] *= 0.3
    inputs, candidates = np.zeros((2, len(NAMES), side, side)), []
    for f in range(2):
        images = [truth * (1 + 0.5 * rng.normal(size=truth.shape)), truth * 1.3, truth * 1.02, truth * 0.6][:have]
        candidates.append(np.concatenate(images))
        for k in range(have):
            for c in range(3):
                inputs[f, NAMES.index(SLOTS[k] + '.' + 'RGB'[c])] = np.log2(1 + images[k][c].clip(0) / 0.03) / 8
    base = os.path.join(folder, '%06d' % seed)
    np.save(base + '.inputs.npy', inputs.astype(np.float16))
    np.save(base + '.candidates.npy', (np.stack(candidates) * 4).astype(np.float16))
    np.save(base + '.reference.npy', (np.concatenate([truth, truth * 0]) * 4).astype(np.float16))
    with open(base + '.json', 'w') as out:
        json.dump({'seed': seed, 'layout': 'edge', 'size': side, 'scale': 4.0, 'inputs': NAMES,
                   'candidates': SLOTS[:have], 'frames': [{'mean_spp': 4.0}, {'mean_spp': 16.0}]}, out)


class NetworkTest(unittest.TestCase):
    def setUp(self):
        self.place = tempfile.TemporaryDirectory()
        self.addCleanup(self.place.cleanup)
        self.folder = self.place.name

    def frames(self, scenes=10):
        rng = np.random.default_rng(1)
        for seed in range(1, scenes + 1):
            write_scene(self.folder, seed, rng, 3 if seed % 3 == 0 else 4)
        return shards.Frames(self.folder)

    def test_tza_has_the_published_layout(self):
        path = os.path.join(self.folder, 'a.tza')
        weight = np.arange(2 * 3 * 9, dtype=np.float32).reshape(2, 3, 3, 3) / 8
        tza.write({'a.weight': weight, 'a.bias': np.array([0.5, -1e-3])}, path)
        with open(path, 'rb') as source:
            data = source.read()
        table = struct.unpack_from('<HBBQ', data)
        self.assertEqual(table[:3], (0x41D7, 2, 0))
        self.assertEqual(data[64:64 + 108], weight.astype('<f2').tobytes())
        expected = (struct.pack('<I', 2) + b'\x08\0a.weight\x04' + struct.pack('<4I', 2, 3, 3, 3) + b'oihwh'
                    + struct.pack('<Q', 64) + b'\x06\0a.bias\x01' + struct.pack('<I', 2) + b'xh' + struct.pack('<Q', 192))
        self.assertEqual(data[table[3]:], expected)
        again = tza.read(path)
        np.testing.assert_array_equal(again['a.weight'], weight)
        np.testing.assert_allclose(again['a.bias'], [0.5, -1e-3], rtol=1e-3)
        with self.assertRaisesRegex(ValueError, 'a.bias'):
            tza.write({'a.bias': np.array([1e6])}, path)

    def test_exported_weights_are_the_network(self):
        network = model.Blend(3, 2, (4, 6, 5), (7, 4))
        path = os.path.join(self.folder, 'b.tza')
        network.export(path, 'f')
        other = model.Blend(3, 2, (4, 6, 5), (7, 4))
        other.load_state_dict({n: torch.from_numpy(np.array(v)) for n, v in tza.read(path).items()})
        x = torch.randn(1, 3, 12, 20)
        torch.testing.assert_close(other(x), network(x), rtol=0, atol=0)
        self.assertEqual(network.weight_count(), sum(v.size for v in network.tensors().values()))
        # 3x3: enc 4*3, 6*4 at a quarter, 5*6 at a sixteenth; dec 7*11 at a quarter, 4*11; out 2*4.
        self.assertAlmostEqual(network.kmac_per_pixel() * 1000, 9 * (12 + 24 / 4 + 30 / 16 + 77 / 4 + 44 + 8))

    def test_absent_candidates_weigh_nothing(self):
        logits = torch.randn(2, 4, 3, 3) * 30
        mask = torch.tensor([[1., 1, 1, 1], [1, 0, 0, 1]])
        weights = model.masked_softmax(logits, mask)
        torch.testing.assert_close(weights.sum(1), torch.ones(2, 3, 3))
        self.assertEqual(float(weights[1, 1:3].abs().max()), 0)
        torch.testing.assert_close(weights[1, [0, 3]], torch.softmax(logits[1, [0, 3]], 0))
        torch.testing.assert_close(weights[0], torch.softmax(logits[0], 0))
        # Nor do their numbers, however odd.
        candidates = torch.rand(2, 4, 3, 3, 3)
        candidates[1, 1:3] = 1e30
        self.assertLessEqual(float(model.blended(weights, candidates)[1].max()), 1)

    def test_inputs_of_hidden_candidates_are_zeros(self):
        mask = torch.tensor([[1., 1, 0, 1]])
        shown = model.hidden(torch.ones(1, len(NAMES), 2, 2), NAMES, SLOTS, mask)[0, :, 0, 0]
        for name, value in zip(NAMES, shown.tolist()):
            self.assertEqual(value, 0 if name.startswith('rd.') else 1, name)
        self.assertEqual(model.slots_of(NAMES), SLOTS)

    def test_masks_keep_two_and_what_is_always_there(self):
        rng = np.random.default_rng(0)
        available = torch.tensor([[1., 1, 1, 1], [1, 1, 0, 1], [1, 0, 0, 1]]).repeat(100, 1)
        masks = train.draw_mask(available, {**train.DEFAULTS, 'drop': 0.9}, rng)
        self.assertTrue((masks <= available).all())
        self.assertTrue((masks.sum(1) >= 2).all())
        self.assertTrue((masks[0::3, :2] == 1).all())
        self.assertGreater(len({tuple(m) for m in masks.tolist()}), 4)

    def test_crops_turn_all_planes_alike(self):
        frames = self.frames(2)
        # Planes that tell where they are: each input, candidate and reference is a function of the pixel's place.
        y, x = torch.meshgrid(torch.arange(32.), torch.arange(32.), indexing='ij')
        code = x + 32 * y
        for plane in range(frames.inputs.shape[1]):
            frames.inputs[:, plane] = code + (plane * 300 if NAMES[plane][-2:] in ('.R', '.G', '.B') else 0)
        colors = torch.arange(3.)[:, None, None] * 300
        for k in range(4):
            frames.candidates[:, 3 * k:3 * k + 3] = (code + colors) * 4
        frames.references[:, :3] = (code + colors) * 4
        rng, turns = np.random.default_rng(2), set()
        for _ in range(20):
            inputs, candidates, reference = frames.crops([0, 1, 2, 3], 16, rng)
            for k in range(4):
                torch.testing.assert_close(candidates[:, k], reference)
            place = inputs[:, 0]
            order = [int(c) for c in (reference[0, :, 0, 0] - place[0, 0, 0]).round() / 300]
            self.assertEqual(sorted(order), [0, 1, 2])
            for c in range(3):
                torch.testing.assert_close(reference[:, c], place + 300 * order[c])
                for stem in ('albedo', 'none', 'oidn'):
                    i = NAMES.index(stem + '.' + 'RGB'[c])
                    first = NAMES.index(stem + '.R')
                    torch.testing.assert_close(inputs[:, i], place + 300 * (first + order[c]), rtol=1e-3, atol=8)
            for b in range(4):  # neighbours stay neighbours
                right, down = (float(d) for d in (place[b, 0, 1] - place[b, 0, 0], place[b, 1, 0] - place[b, 0, 0]))
                self.assertEqual(sorted((abs(right), abs(down))), [1, 32])
                turns.add((right, down))
        self.assertEqual(len(turns), 8)

    def test_training_finds_the_right_candidate_and_goes_on(self):
        frames = self.frames()
        o = {**train.DEFAULTS, **SMALL}
        folder = os.path.join(self.folder, 'out')
        network, facts = train.train(frames, o, folder, 1e9, 150)
        rows = train.evaluate(network, frames)
        everything = train.ratios([r for r in rows if r['subset'] == 'all'])
        self.assertEqual({r['seed'] for r in rows}, {10})
        without = train.ratios([r for r in rows if r['subset'] == 'without rd'])
        self.assertLess(everything['bilateral'], 0.1)
        self.assertLess(everything['mean'], 0.5)
        self.assertLess(without['bilateral'], 1.1)
        self.assertIn('150 steps', train.table({'small': (rows, facts)}))
        _, facts = train.train(frames, o, folder, 1e9, 200)
        self.assertEqual(facts['steps'], 200)
        with open(os.path.join(folder, 'curve.csv')) as source:
            self.assertEqual([line.split(',')[0] for line in source], ['step', '50', '100', '150', '200'])
        with self.assertRaisesRegex(SystemExit, 'other options'):
            train.train(frames, {**o, 'batch': 2}, folder, 1e9, 300)
        self.assertEqual(tza.read(os.path.join(folder, 'model.tza'))['out_conv.weight'].shape, (4, 8, 3, 3))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
