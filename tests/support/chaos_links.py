"""TCP proxies, each between one worker and the server, that can stall, slow down, cut or mangle what passes."""
import asyncio
import random
import threading

CHUNK = 1 << 14
UP, DOWN = 'up', 'down'  # to the server, to the worker


class Link:
    """One proxy. Its fields are set by other threads, and read before each chunk that passes."""

    def __init__(self, links, seed):
        self.links, self.random = links, random.Random(seed)
        self.stalled = frozenset()   # of UP and DOWN
        self.bytes_per_second = None
        self.delay = 0.0             # seconds, of each chunk
        self.mangle = []             # what is to be done to the next chunks: 'corrupt', 'duplicate', 'reorder'
        self.mangled = 0             # chunks
        self.writers = set()
        self.server = links.call(asyncio.start_server(self._connected, '127.0.0.1', 0))
        self.address = '127.0.0.1:%d' % self.server.sockets[0].getsockname()[1]

    def heal(self):
        self.stalled, self.bytes_per_second, self.delay, self.mangle = frozenset(), None, 0.0, []

    def cut(self):
        """Both sides see their connections reset."""
        self.links.loop.call_soon_threadsafe(lambda: [w.transport.abort() for w in list(self.writers)])

    async def _connected(self, worker_reader, worker_writer):
        self.writers.add(worker_writer)
        server_writer = None
        try:
            server_reader, server_writer = await asyncio.open_connection('127.0.0.1', self.links.port)
            self.writers.add(server_writer)
            pumps = [asyncio.ensure_future(self._pump(worker_reader, server_writer, UP)),
                     asyncio.ensure_future(self._pump(server_reader, worker_writer, DOWN))]
            await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
            for pump in pumps:
                pump.cancel()
            await asyncio.gather(*pumps, return_exceptions=True)
        except OSError:
            pass  # no server: the worker sees its connection closed
        finally:
            for writer in (worker_writer, server_writer):
                if writer:
                    self.writers.discard(writer)
                    writer.close()

    async def _pump(self, reader, writer, direction):
        while data := await reader.read(CHUNK):
            if self.bytes_per_second:
                await asyncio.sleep(self.delay + len(data) / self.bytes_per_second)
            while direction in self.stalled:
                await asyncio.sleep(0.02)
            if self.mangle:
                data = await self._mangled(self.mangle.pop(), data, reader)
            writer.write(data)
            await writer.drain()

    async def _mangled(self, how, data, reader):
        if how == 'reorder':
            try:
                data = await asyncio.wait_for(reader.read(CHUNK), 0.3) + data
            except asyncio.TimeoutError:
                return data  # nothing came that could overtake it
        elif how == 'duplicate':
            data += data
        else:
            at = self.random.randrange(len(data))
            data = data[:at] + bytes([data[at] ^ 1 << self.random.randrange(8)]) + data[at + 1:]
        self.mangled += 1
        return data


class Links:
    """Proxies to a port of this machine, all on one thread. A context manager."""

    def __init__(self, port, count, seed):
        self.port, self.loop = port, asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        self.links = [Link(self, f'{seed}/{i}') for i in range(count)]

    def __getitem__(self, i):
        return self.links[i]

    def call(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.call(self._end())
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join()
        self.loop.close()

    async def _end(self):
        for link in self.links:
            link.server.close()
        rest = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in rest:
            task.cancel()
        await asyncio.gather(*rest, return_exceptions=True)
