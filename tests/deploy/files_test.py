#!/usr/bin/python3
"""What can be said of deploy/'s files without an engine: they parse, their programs know the options that they are
given, selectors find what they are meant for, secrets are there, nobody gets rights.

    files_test.py BIN_DIR SOURCE_DIR        exit code 77: skipped, Python's yaml is missing
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import yaml
except ImportError:
    print("skipped: needs Debian's python3-yaml (deploy/setup --bench)")
    sys.exit(77)

BIN, SOURCE = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
DEPLOY = SOURCE / 'deploy'
PROGRAMS = ('relume-server', 'relume-worker')
STOP_SECONDS = 10  # from SIGTERM to SIGKILL, at least: docs/operations.md


def options(program):
    shown = subprocess.run([BIN / program, '--help'], check=True, text=True, stdout=subprocess.PIPE).stdout
    return set(re.findall(r'--[a-z][a-z-]*', shown))


def manifests():
    """All objects of deploy/kubernetes, as its files have them, with the file's name."""
    found = []
    for path in sorted((DEPLOY / 'kubernetes').rglob('*.yaml')):
        found += [(path.relative_to(DEPLOY), object_) for object_ in yaml.safe_load_all(path.read_text())]
    return found


def of_kind(*kinds):
    return [object_ for _, object_ in manifests() if object_['kind'] in kinds]


def pod(workload):
    return workload['spec']['template']


class FilesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.known = {program: options(program) for program in PROGRAMS}

    def check_command(self, words, where):
        self.assertIn(words[0], PROGRAMS, where)
        used = {word.split('=')[0] for word in words if word.startswith('--')}
        self.assertTrue(used, where)
        self.assertEqual(used - self.known[words[0]], set(), f'{where}: {words[0]} does not know these')

    def test_commands_have_options_that_programs_know(self):
        for name in ('docker-compose.yml', 'docker-compose.monitoring.yml'):
            services = yaml.safe_load((DEPLOY / name).read_text())['services']
            for service, what in services.items():
                if service in ('server', 'worker'):
                    self.check_command(what['command'].split(), f'{name}: {service}')
        for workload in of_kind('StatefulSet', 'Deployment'):
            self.check_command(pod(workload)['spec']['containers'][0]['command'], workload['kind'])
        for name in ('server', 'worker'):
            text = (DEPLOY / 'slurm' / name).read_text().replace('\\\n', ' ')
            command = re.search(rf'^ *(?:exec )?(relume-{name} .*)$', text, re.MULTILINE).group(1)
            self.check_command(command.split(), f'slurm/{name}')

    def test_kubernetes_kustomizations_list_every_file(self):
        for folder in ('farm', 'autoscaled'):
            at = DEPLOY / 'kubernetes' / folder
            listed = yaml.safe_load((at / 'kustomization.yaml').read_text())['resources']
            files = {path.name for path in at.glob('*.yaml')} - {'kustomization.yaml'}
            self.assertEqual(files, {name for name in listed if name.endswith('.yaml')}, folder)

    def test_kubernetes_selectors_find_one_workload_each(self):
        workloads = of_kind('StatefulSet', 'Deployment')
        self.assertEqual(len(workloads), 2)

        def finds(labels):
            return [workload['metadata']['name'] for workload in workloads
                    if labels.items() <= pod(workload)['metadata']['labels'].items()]

        for workload in workloads:
            self.assertEqual(finds(workload['spec']['selector']['matchLabels']), [workload['metadata']['name']])
        for service in of_kind('Service'):
            self.assertEqual(finds(service['spec']['selector']), [service['metadata']['name']])
            ports = {port['name'] for workload in workloads if workload['metadata']['name'] == service['metadata']['name']
                     for port in pod(workload)['spec']['containers'][0]['ports']}
            self.assertEqual({port['targetPort'] for port in service['spec']['ports']}, ports)
        for budget in of_kind('PodDisruptionBudget'):
            self.assertEqual(finds(budget['spec']['selector']['matchLabels']), [budget['metadata']['name']])
        for policy in of_kind('NetworkPolicy'):
            selector = policy['spec']['podSelector']
            if policy['metadata']['name'] != 'nothing-else':
                self.assertEqual(finds(selector['matchLabels']), [policy['metadata']['name']])
        for scaler in of_kind('ScaledObject'):
            self.assertIn(scaler['spec']['scaleTargetRef']['name'], [w['metadata']['name'] for w in workloads])

    def test_kubernetes_pods_have_their_secrets_and_no_rights(self):
        secrets = {secret['name']: {pathlib.Path(file).name for file in secret['files']}
                   for kustomization in of_kind('Kustomization') for secret in kustomization.get('secretGenerator', ())}
        for workload in of_kind('StatefulSet', 'Deployment'):
            spec = pod(workload)['spec']
            container = spec['containers'][0]
            keys = next(volume for volume in spec['volumes'] if volume['name'] == 'keys')['secret']
            mount = next(mount['mountPath'] for mount in container['volumeMounts'] if mount['name'] == 'keys')
            read = {pathlib.Path(word.split('=')[1]).name for word in container['command'] if f'={mount}/' in word}
            self.assertEqual(read, secrets[keys['secretName']])
            # Programs refuse keys that everybody may read.
            self.assertEqual(keys['defaultMode'] & 0o007, 0)
            named = {volume['name'] for volume in spec['volumes']}
            named |= {claim['metadata']['name'] for claim in workload['spec'].get('volumeClaimTemplates', ())}
            self.assertEqual({mount['name'] for mount in container['volumeMounts']}, named)
            self.assertTrue(spec['securityContext']['runAsNonRoot'])
            self.assertFalse(container['securityContext']['allowPrivilegeEscalation'])
            self.assertTrue(container['securityContext']['readOnlyRootFilesystem'])
            self.assertEqual(container['securityContext']['capabilities'], {'drop': ['ALL']})
            self.assertEqual(set(container['resources']['limits']), {'cpu', 'memory'})
            # Programs find the limits by themselves: said twice, they would be changed once.
            self.assertEqual([word for word in container['command'] if re.match('--(threads|memory-limit)', word)], [])

    def test_containers_have_time_to_stop(self):
        services = yaml.safe_load((DEPLOY / 'docker-compose.yml').read_text())['services']
        for service in ('server', 'worker'):
            self.assertGreaterEqual(int(services[service]['stop_grace_period'].removesuffix('s')), STOP_SECONDS, service)
        for workload in of_kind('StatefulSet', 'Deployment'):
            self.assertGreaterEqual(pod(workload)['spec']['terminationGracePeriodSeconds'], STOP_SECONDS, workload['kind'])

    def test_the_scaler_asks_for_metrics_that_are_there(self):
        known = set(re.findall(r'`(relume_[a-z_]+)`', (SOURCE / 'docs' / 'operations.md').read_text()))
        asked = {name for scaler in of_kind('ScaledObject') for trigger in scaler['spec']['triggers']
                 for name in re.findall(r'relume_[a-z_]+', trigger['metadata']['query'])}
        self.assertTrue(asked)
        self.assertEqual(asked - known, set())

    @unittest.skipUnless(shutil.which('kubectl'), 'no kubectl')
    def test_kubectl_builds_the_kustomizations(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder) / 'kubernetes'
            shutil.copytree(DEPLOY / 'kubernetes', copy, ignore=shutil.ignore_patterns('certs'))
            subprocess.run([DEPLOY / 'certs', copy / 'farm' / 'certs'], check=True, stdout=subprocess.DEVNULL)
            for name in ('farm', 'autoscaled'):
                built = subprocess.run(['kubectl', 'kustomize', copy / name], text=True, stdout=subprocess.PIPE,
                                       stderr=subprocess.PIPE)
                self.assertEqual(built.returncode, 0, built.stderr)
                kinds = [object_['kind'] for object_ in yaml.safe_load_all(built.stdout)]
                self.assertEqual(kinds.count('Secret'), 2)
                self.assertEqual(kinds.count('ScaledObject'), 1 if name == 'autoscaled' else 0)
                self.assertIn('StatefulSet', kinds)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
