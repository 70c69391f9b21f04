#!/usr/bin/python3
"""A scene that costs workers fails its job and nothing else; workers stay within their memory; who is stopped
leaves in order.

    losses_test.py BIN_DIR SOURCE_DIR

Real processes on loopback. A fault in the renderer is a signal sent to the thread that renders.
"""
import base64
import ctypes
import json
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, Farm, ROOM, environment, relume

TGKILL = 234  # x86-64
LONG = (ROOM, '--size', '256x256', '--spp', '8192', '--tile-size', '64', '--sampler', 'uniform', '--filter', 'none')
SHORT = (ROOM, '--size', '40x25', '--spp', '4', '--filter', 'none')


def until(good, seconds=60):
    """What `good` answers, as soon as that is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := good():
            return found
        time.sleep(0.005)
    raise AssertionError('waited in vain')


def render_thread(pid):
    """The thread that renders, once it does."""
    for task in pathlib.Path(f'/proc/{pid}/task').iterdir():
        try:
            fields = (task / 'stat').read_text()
        except OSError:
            continue  # it has ended
        name, rest = fields[fields.index('(') + 1:].rsplit(')', 1)
        if name == 'render' and int(rest.split()[11]) >= 3:  # ticks of user time
            return int(task.name)
    return None


def big_picture_scene(folder):
    """A triangle with a picture of 12000x12000 pixels, 432 MB, which compress well."""
    side = 12000
    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    row = b'\0' + b'\xc0' * (3 * side)
    pack = zlib.compressobj(1)
    data = b''.join(pack.compress(row) for _ in range(side)) + pack.flush()
    (folder / 'big.png').write_bytes(b'\x89PNG\r\n\x1a\n' + chunk(
        b'IHDR', struct.pack('>IIBBBBB', side, side, 8, 2, 0, 0, 0)) + chunk(b'IDAT', data) + chunk(b'IEND', b''))
    floats = struct.pack('<15f', -1, -1, -3, 1, -1, -3, 0, 1, -3, 0, 0, 1, 0, 0.5, 1)
    gltf = {
        'asset': {'version': '2.0'}, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0, 'TEXCOORD_0': 1}, 'material': 0}]}],
        'accessors': [
            {'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [-1, -1, -3], 'max': [1, 1, -3]},
            {'bufferView': 1, 'componentType': 5126, 'count': 3, 'type': 'VEC2'}],
        'bufferViews': [{'buffer': 0, 'byteLength': 36}, {'buffer': 0, 'byteOffset': 36, 'byteLength': 24}],
        'buffers': [{'byteLength': 60, 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(floats).decode()}],
        'images': [{'uri': 'big.png'}], 'textures': [{'source': 0}],
        'materials': [{'emissiveFactor': [1, 1, 1], 'emissiveTexture': {'index': 0},
                       'pbrMetallicRoughness': {'baseColorTexture': {'index': 0}}}],
    }
    (folder / 'scene.gltf').write_text(json.dumps(gltf))
    return folder / 'scene.gltf'


class LossesTest(unittest.TestCase):
    def test_a_scene_that_crashes_workers_fails_its_job_alone(self):
        with Farm('--cross-check', '0') as farm:
            name = relume('submit', *LONG, server=farm.address).stdout.strip()
            lost = 0
            while (job := farm.job(name))['state'] != 'failed':
                self.assertLess(lost, 10)
                worker = farm.start_worker()
                thread = until(lambda: render_thread(worker.pid))
                ctypes.CDLL(None).syscall(TGKILL, worker.pid, thread, int(signal.SIGSEGV))
                self.assertEqual(worker.wait(timeout=20), -signal.SIGSEGV)
                lost += 1
            self.assertGreaterEqual(lost, 2)
            self.assertIn('died of signal 11 (SIGSEGV) while it had pixels', job['message'])
            farm.start_worker()
            done = relume('watch', relume('submit', *SHORT, server=farm.address).stdout.strip(),
                          '--json', '--quiet', server=farm.address)
            self.assertEqual(json.loads(done.stdout)['state'], 'succeeded')

    def test_a_scene_that_needs_more_memory_than_a_worker_may_take_goes_elsewhere(self):
        with tempfile.NamedTemporaryFile('w') as log, Farm('--cross-check', '0', log=log) as farm:
            def said():
                return pathlib.Path(log.name).read_text()
            small = farm.start_worker('--memory-limit', '512M')
            scene = big_picture_scene(farm.folder)
            name = relume('submit', scene, '--size', '16x16', '--spp', '4', '--filter', 'none',
                          server=farm.address).stdout.strip()
            until(lambda: 'needs more than the 0.537 GB that this worker may take' in said())
            self.assertIsNone(small.poll())
            farm.start_worker()
            job = json.loads(relume('watch', name, '--json', '--quiet', server=farm.address).stdout)
            self.assertEqual(job['state'], 'succeeded')
            # It still does what fits.
            farm.workers[1].terminate()
            farm.workers[1].wait(timeout=20)
            relume('watch', relume('submit', *SHORT, server=farm.address).stdout.strip(), '--quiet',
                   server=farm.address)

    def test_a_limit_that_no_worker_can_keep_is_refused(self):
        run = subprocess.run([BIN / 'relume-worker', '--server', '127.0.0.1:1', '--memory-limit', '10M'],
                             env=environment(), stderr=subprocess.PIPE, text=True, timeout=30)
        self.assertEqual(run.returncode, 1)
        self.assertIn('--memory-limit', run.stderr)

    def test_a_worker_that_is_stopped_leaves_and_costs_nothing(self):
        with Farm('--cross-check', '0') as farm:
            first = farm.start_worker()
            name = relume('submit', *LONG, server=farm.address).stdout.strip()
            until(lambda: render_thread(first.pid))
            start = time.monotonic()
            first.terminate()
            self.assertEqual(first.wait(timeout=20), 0)
            print(f'a worker left after {time.monotonic() - start:.2f} s', file=sys.stderr)
            # Whoever joins late is used at once.
            second = farm.start_worker()
            until(lambda: render_thread(second.pid))
            relume('cancel', name, server=farm.address)

    def test_a_server_that_is_stopped_saves_what_came_in(self):
        job = (ROOM, '--size', '112x70', '--spp', '256', '--seed', '3', '--filter', 'none')
        with Farm('--save-every', '1000') as farm:
            farm.start_worker()
            name = relume('submit', *job, server=farm.address).stdout.strip()
            client = subprocess.Popen([BIN / 'relume', 'watch', name, '--quiet'], env=environment(farm.address))
            before = until(lambda: (j := farm.job(name))['samples'] > 100_000 and j)
            self.assertEqual(before['state'], 'rendering')
            farm.server.terminate()
            self.assertEqual(farm.server.wait(timeout=20), 0)
            farm.server.stdout.close()
            farm.start_server()
            self.assertGreaterEqual(farm.job(name)['samples'], before['samples'])
            again = json.loads(relume('watch', name, '--json', '--quiet', server=farm.address).stdout)
            self.assertEqual(client.wait(timeout=60), 0)
            self.assertEqual(again['restarts'], 1)
            self.assertTrue(again['ledger']['clean'])
            twin = json.loads(relume('watch', relume('submit', *job, server=farm.address).stdout.strip(), '--json',
                                     '--quiet', server=farm.address).stdout)
            self.assertEqual(again['image_sha256'], twin['image_sha256'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
