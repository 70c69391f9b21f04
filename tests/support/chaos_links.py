"""TCP proxies, each between one program and the server, that can stall, slow down, cut or mangle what passes."""
import random
import socket
import struct
import threading
import time

CHUNK = 1 << 14
UP, DOWN = 'up', 'down'  # to the server, away from it
CONNECT_PATIENCE = 5     # seconds
OVERTAKE_PATIENCE = 0.3  # seconds that a chunk waits for the one that is to overtake it
STEP = 0.02              # seconds between looks at what a link is to do


def end(connection, reset):
    """Wakes whoever waits for it in another thread. `reset`: what is on its way is lost, and the peer told so."""
    try:
        if reset:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:
        pass  # closed already
    connection.close()


class Link:
    """One proxy, on threads of its own, from a port of loopback to `target` (host, port). Its fields are set by other
    threads, and read before each chunk that passes. A context manager: nothing passes after its end."""

    def __init__(self, target, seed=0, listen=('127.0.0.1', 0)):
        self.target, self.random = target, random.Random(seed)
        self.stalled = frozenset()   # of UP and DOWN
        self.bytes_per_second = None
        self.delay = 0.0             # seconds, of each chunk
        self.mangle = []             # for the next chunks: ('corrupt' | 'duplicate' | 'reorder', UP | DOWN)
        self.mangled = 0             # chunks so far
        self.mutex = threading.Lock()
        self.open = set()            # connections, guarded by mutex
        self.ended = False           # likewise
        self.listener = socket.create_server(listen, backlog=64)
        self.address = '%s:%d' % self.listener.getsockname()[:2]
        threading.Thread(target=self._accept, daemon=True).start()

    def heal(self):
        self.stalled, self.bytes_per_second, self.delay, self.mangle = frozenset(), None, 0.0, []

    def cut(self):
        """Both sides see their connections reset."""
        with self.mutex:
            connections = list(self.open)
        for connection in connections:
            end(connection, reset=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with self.mutex:
            self.ended = True
        self.heal()
        try:
            self.listener.shutdown(socket.SHUT_RDWR)  # wakes _accept
        except OSError:
            pass
        self.listener.close()
        self.cut()

    # --- what passes ---

    def _accept(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self._connected, args=(connection,), daemon=True).start()

    def _keep(self, connection):
        with self.mutex:
            if not self.ended:
                self.open.add(connection)
                return True
        end(connection, reset=True)
        return False

    def _drop(self, *connections, reset=False):
        with self.mutex:
            self.open.difference_update(connections)
        for connection in connections:
            end(connection, reset)

    def _connected(self, near):
        if not self._keep(near):
            return
        try:
            far = socket.create_connection(self.target, timeout=CONNECT_PATIENCE)
        except OSError:
            self._drop(near)  # no server: it sees its connection closed
            return
        far.settimeout(None)
        if not self._keep(far):
            self._drop(near)
            return
        for connection in (near, far):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        threading.Thread(target=self._pump, args=(near, far, UP), daemon=True).start()
        self._pump(far, near, DOWN)

    def _pump(self, source, sink, direction):
        try:
            while data := source.recv(CHUNK):
                if self.bytes_per_second:
                    time.sleep(self.delay + len(data) / self.bytes_per_second)
                while direction in self.stalled:
                    time.sleep(STEP)
                sink.sendall(self._mangled(data, source, direction))
            # Neither gRPC nor TLS goes on in one direction alone.
            self._drop(source, sink)
        except OSError:
            self._drop(source, sink, reset=True)

    def _next_mangling(self, direction):
        for k, (how, way) in enumerate(self.mangle):
            if way == direction:
                self.mangle = self.mangle[:k] + self.mangle[k + 1:]
                return how
        return None

    def _mangled(self, data, source, direction):
        how = self._next_mangling(direction)
        if how == 'reorder':
            source.settimeout(OVERTAKE_PATIENCE)
            try:
                data = source.recv(CHUNK) + data
            except TimeoutError:
                return data  # nothing came that could overtake it
            finally:
                source.settimeout(None)
        elif how == 'duplicate':
            data += data
        elif how == 'corrupt':
            at = self.random.randrange(len(data))
            data = data[:at] + bytes([data[at] ^ 1 << self.random.randrange(8)]) + data[at + 1:]
        self.mangled += how is not None
        return data
