#!/usr/bin/python3
"""A farm with TLS, certificates of roles and a join token, as processes: who is refused, what is said and
logged of it, with which exit codes; and the same bits as without.

    tls_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, Farm, ROOM, SOURCE, environment, relume

JOB = (ROOM, '--size', '96x60', '--spp', '8', '--filter', 'bilateral')
PATIENCE = 60  # seconds; no test waits for so long unless it fails


class TlsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        for name in ('certs', 'foreign'):
            subprocess.run([SOURCE / 'deploy' / 'certs', cls.folder / name], check=True,
                           stdout=subprocess.DEVNULL)
        cls.token = cls.folder / 'token'
        cls.token.write_text('0123456789abcdef0123456789abcdef\n')
        cls.token.chmod(0o600)
        cls.log = cls.folder / 'server.log'
        with open(cls.log, 'w') as log:
            cls.farm = Farm(*cls.tls('server'), '--join-token', cls.token, log=log)

    @classmethod
    def tearDownClass(cls):
        cls.farm.stop()
        cls.temporary.cleanup()

    @classmethod
    def tls(cls, role, ca='certs', identity='certs'):
        own = cls.folder / identity / role
        return ('--tls-cert', own / 'cert.pem', '--tls-key', own / 'key.pem',
                '--tls-ca', cls.folder / ca / 'ca' / 'ca.pem')

    def logged(self, *words):
        """Waits until one line of the server's log has all words."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if any(all(word in line for word in words) for line in self.log.read_text().splitlines()):
                return
            time.sleep(0.05)
        self.fail(f'{words} not in {self.log.read_text()}')

    def refused(self, *options, says, code=4):
        run = relume('jobs', '--server', self.farm.address, *options, check=False)
        self.assertEqual(run.returncode, code, run.stderr)
        lines = run.stderr.splitlines()
        self.assertEqual(len(lines), 1, run.stderr)
        for words in says:
            self.assertIn(words, lines[0])

    def worker_refused(self, *options, says):
        run = subprocess.run(
            [BIN / 'relume-worker', '--server', self.farm.address, '--threads', '1', '--cache',
             self.folder / 'cache', *map(str, options)], env=environment(), text=True,
            stderr=subprocess.PIPE, timeout=PATIENCE)
        self.assertEqual(run.returncode, 1, run.stderr)
        for words in says:
            self.assertIn(words, run.stderr.splitlines()[-1])

    def test_clients_without_a_good_certificate(self):
        self.refused(says=[self.farm.address, 'speaks TLS', '--tls-ca'])
        self.refused('--tls-ca', self.folder / 'certs' / 'ca' / 'ca.pem',
                     says=['asks for a certificate', '--tls-cert', 'deploy/certs'])
        self.logged('refused a connection', 'peer did not return a certificate')
        self.refused(*self.tls('client', identity='foreign'), says=['refuses our certificate', 'another CA'])
        self.logged('refused a connection', 'certificate verify failed')
        self.refused(*self.tls('client', ca='foreign'), says=['server', 'is not believed', '--tls-ca'])

    def test_a_workers_certificate_makes_no_jobs(self):
        self.refused(*self.tls('worker'), says=["'worker' is a worker's", 'for clients', 'relume/client'])
        self.logged('refused ipv4:127.0.0.1', "'worker' is a worker's")

    def test_an_expired_certificate_is_refused_before_it_is_shown(self):
        old, certs = self.folder / 'old', self.folder / 'certs'
        old.mkdir()
        subprocess.run(
            f'openssl req -new -key {certs}/client/key.pem -subj /CN=old -out {old}/request.pem && '
            f'openssl x509 -req -in {old}/request.pem -CA {certs}/ca/ca.pem -CAkey {certs}/ca/key.pem '
            f'-days -1 -out {old}/cert.pem', shell=True, check=True, stderr=subprocess.DEVNULL)
        self.refused('--tls-cert', old / 'cert.pem', '--tls-key', certs / 'client' / 'key.pem',
                     '--tls-ca', certs / 'ca' / 'ca.pem', code=2, says=[str(old / 'cert.pem'), 'has expired on'])

    def test_workers_that_may_not_work(self):
        token = ('--join-token', self.token)
        self.worker_refused(*self.tls('client'), *token, says=["'client' is a client's", 'for workers'])
        self.logged('refused ipv4:127.0.0.1', "'client' is a client's", 'for workers')
        self.worker_refused(*self.tls('worker'), says=['--join-token'])
        self.logged('refused ipv4:127.0.0.1', 'join token')
        self.worker_refused(*token, says=['speaks TLS'])
        self.worker_refused(*self.tls('worker', identity='foreign'), *token, says=['another CA'])

    def test_the_same_bits_as_without_tls(self):
        out = self.folder / 'out.exr'
        plain = json.loads(relume('render', *JOB, '-o', out, '--json', '--quiet').stdout)
        worker = self.farm.start_worker(*self.tls('worker'), '--join-token', self.token)
        run = relume('render', *JOB, '-o', out, '--json', '--quiet', '--server', self.farm.address,
                     *self.tls('client'))
        self.assertEqual(json.loads(run.stdout)['image_sha256'], plain['image_sha256'])
        self.assertIsNone(worker.poll())
        # By the environment; and a local farm does not take what is meant for a server.
        own = self.folder / 'certs' / 'client'
        env = {'RELUME_SERVER': self.farm.address, 'RELUME_TLS_CA': own / 'ca.pem',
               'RELUME_TLS_CERT': own / 'cert.pem', 'RELUME_TLS_KEY': own / 'key.pem'}
        workers = json.loads(relume('workers', '--json', env=env).stdout)
        self.assertEqual(len(workers), 1)
        local = relume('render', *JOB, '-o', out, '--json', '--quiet', '--workers', 1, env=env)
        self.assertEqual(json.loads(local.stdout)['image_sha256'], plain['image_sha256'])

    def test_a_server_is_not_open_by_mistake(self):
        def starts(*options):
            run = subprocess.run([BIN / 'relume-server', '--data', self.folder / 'none', *map(str, options)],
                                 env=environment(), text=True, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, timeout=PATIENCE)
            self.assertEqual(run.returncode, 1, run.stderr)
            return run.stderr
        for words in ('--tls-cert', '--insecure', 'deploy/certs'):
            self.assertIn(words, starts('--listen', '0.0.0.0:0'))
        self.assertIn('in the clear', starts('--listen', '0.0.0.0:0', '--insecure', '--join-token', self.token))
        self.assertIn('its own certificate',
                      starts('--listen', '127.0.0.1:0', '--tls-ca', self.folder / 'certs' / 'ca' / 'ca.pem'))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
