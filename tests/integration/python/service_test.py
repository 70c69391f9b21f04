#!/usr/bin/python3
"""Relume as a service, seen by a client in another language.

    service_test.py BIN_DIR SOURCE_DIR

Starts a server and two workers as processes on loopback, makes Python stubs with protoc and
grpc_python_plugin, submits the demo room, watches it and fetches the EXR; asks health and reflection;
then has `relume submit` render the same job from a third process, and compares image digests.
"""
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import uuid

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, Farm, ROOM as SCENE, SOURCE

SIZE, SPP, CHUNK = (96, 60), 8, 1 << 20


def make_stubs(folder):
    """Generates the modules of proto/ and of the two standard services into `folder`."""
    here = pathlib.Path(__file__).parent
    plugin = subprocess.check_output(['which', 'grpc_python_plugin'], text=True).strip()
    for root, files in ((SOURCE / 'proto', sorted((SOURCE / 'proto').rglob('*.proto'))),
                        (here, sorted(here.glob('*.proto')))):
        subprocess.run(['protoc', f'-I{root}', f'--python_out={folder}', f'--grpc_python_out={folder}',
                        f'--plugin=protoc-gen-grpc_python={plugin}', *map(str, files)], check=True)
    sys.path.insert(0, str(folder))


class ServiceTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = pathlib.Path(cls.folder.name)
        (root / 'stubs').mkdir()
        make_stubs(root / 'stubs')
        cls.farm = Farm()
        cls.address, cls.server = cls.farm.address, cls.farm.server
        for _ in range(2):
            cls.farm.start_worker()
        import grpc
        cls.grpc = grpc
        cls.channel = grpc.insecure_channel(cls.address)
        grpc.channel_ready_future(cls.channel).result(timeout=20)

    @classmethod
    def tearDownClass(cls):
        cls.channel.close()
        codes = cls.farm.stop()
        cls.folder.cleanup()
        assert codes == [0, 0, 0], f'server and workers ended with {codes}, not 0'

    def test_health_is_serving_and_reflection_lists_the_services(self):
        import health_pb2, health_pb2_grpc, reflection_pb2, reflection_pb2_grpc
        health = health_pb2_grpc.HealthStub(self.channel).Check(
            health_pb2.HealthCheckRequest(), timeout=10)
        self.assertEqual(health.status, health_pb2.HealthCheckResponse.SERVING)
        answers = reflection_pb2_grpc.ServerReflectionStub(self.channel).ServerReflectionInfo(
            iter([reflection_pb2.ServerReflectionRequest(list_services='*')]), timeout=10)
        names = {s.name for s in next(answers).list_services_response.service}
        for service in ('JobService', 'BlobService', 'WorkerService'):
            self.assertIn('relume.v1.' + service, names)

    def upload_scene(self):
        from relume.v1 import blobs_pb2, blobs_pb2_grpc, types_pb2
        blobs = blobs_pb2_grpc.BlobServiceStub(self.channel)
        gltf = json.loads(SCENE.read_text())
        paths = [SCENE.name] + [b['uri'] for b in gltf['buffers']] + [
            i['uri'] for i in gltf.get('images', [])]
        manifest, contents = types_pb2.SceneManifest(main=SCENE.name), {}
        for path in dict.fromkeys(paths):
            data = (SCENE.parent / path).read_bytes()
            digest = hashlib.sha256(data).hexdigest()
            contents[digest] = data
            manifest.entries.add(path=path, size=len(data), sha256=digest)
        missing = blobs.FindMissingBlobs(
            blobs_pb2.FindMissingBlobsRequest(sha256=list(contents)), timeout=10).missing

        def chunks(digest, offset):
            data = contents[digest]
            for begin in range(offset, max(len(data), 1), CHUNK):
                yield blobs_pb2.WriteBlobRequest(sha256=digest, size=len(data), offset=begin,
                                                 data=data[begin:begin + CHUNK])
        for blob in missing:
            answer = blobs.WriteBlob(chunks(blob.sha256, blob.offset), timeout=30)
            self.assertEqual(answer.committed_size, len(contents[blob.sha256]))
        return manifest

    def test_a_job_is_submitted_watched_and_fetched_and_equals_the_command_line(self):
        from relume.v1 import jobs_pb2, jobs_pb2_grpc, types_pb2
        jobs = jobs_pb2_grpc.JobServiceStub(self.channel)
        spec = jobs_pb2.JobSpec(
            scene=self.upload_scene(), spp=SPP,
            settings=types_pb2.RenderSettings(width=SIZE[0], height=SIZE[1], seed=7))
        request = jobs_pb2.CreateJobRequest(request_id=str(uuid.uuid4()), spec=spec)
        job = jobs.CreateJob(request, timeout=10).job
        self.assertEqual(jobs.CreateJob(request, timeout=10).job.name, job.name)

        numbers, last = [], None
        for event in jobs.WatchJob(jobs_pb2.WatchJobRequest(name=job.name), timeout=120):
            numbers.append(event.event)
            last = event.job
        self.assertEqual(numbers, sorted(set(numbers)))
        self.assertEqual(last.state, jobs_pb2.JOB_STATE_SUCCEEDED, last.message)
        self.assertGreater(len(last.workers), 0)

        chunks = list(jobs.FetchResult(jobs_pb2.FetchResultRequest(name=job.name), timeout=30))
        data = b''.join(c.data for c in chunks)
        self.assertEqual(data[:4], b'\x76\x2f\x31\x01')  # OpenEXR's magic number
        self.assertEqual(hashlib.sha256(data).hexdigest(), chunks[0].sha256)

        with tempfile.TemporaryDirectory() as folder:
            env = dict(os.environ, RELUME_SERVER=self.address)
            run = subprocess.run(
                [BIN / 'relume', 'submit', SCENE, '--size', '%dx%d' % SIZE, '--spp', str(SPP), '--seed', '7',
                 '--json'], env=env, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
            name = json.loads(run.stdout)['job']
            subprocess.run([BIN / 'relume', 'watch', name, '--quiet'], env=env, check=True)
        twin = jobs.GetJob(jobs_pb2.GetJobRequest(name=name), timeout=10).job
        self.assertEqual(twin.image_sha256, last.image_sha256)

    def test_a_request_that_makes_no_sense_is_answered_and_the_server_lives(self):
        from relume.v1 import jobs_pb2, jobs_pb2_grpc, types_pb2
        jobs = jobs_pb2_grpc.JobServiceStub(self.channel)
        spec = jobs_pb2.JobSpec(spp=8, settings=types_pb2.RenderSettings(width=10**9, height=10**9))
        with self.assertRaises(self.grpc.RpcError) as caught:
            jobs.CreateJob(jobs_pb2.CreateJobRequest(spec=spec), timeout=10)
        self.assertEqual(caught.exception.code(), self.grpc.StatusCode.INVALID_ARGUMENT)
        self.assertIsNone(self.server.poll())


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
