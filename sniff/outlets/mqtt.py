"""MQTT: a connection to a broker that is kept up, and told again all that stands when it comes back.

What a run before left standing at the broker is looked for once a bus is known, and taken away.

While there is no broker only the newest of each topic is kept; what it replaces is counted as dropped. A broker that
takes nothing in costs its time limit and then the connection, never more memory than one window of messages.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import ssl
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sniff.analysis.sanitizing import sanitized
from sniff.outlet_settings import MqttSettings, SettingsError
from sniff.outlets.mqtt_messages import OFFLINE, ONLINE, Messages, Publication
from sniff.outlets.outlet import AT_THE_END, Outlet

if TYPE_CHECKING:
    from aiomqtt import Client

WINDOW = 32
"""Messages that may be on their way to the broker at a time."""

MOST_EVENTS = 1000
"""Messages that are not retained, and wait."""

MOST_PAYLOAD = 64 << 10
"""Octets of a message."""

PATIENCE = 10.0
"""Seconds for the broker to answer anything."""

BACKOFF = (1.0, 2.0, 5.0, 10.0, 30.0)
"""Seconds before the next try to connect."""

TAKEN_AT_ONCE = 512

LOOKED_FOR = 5.0
"""Seconds in which a broker tells what it kept."""

MOST_INCOMING = 1000
"""Messages of the broker that wait to be looked at; of those beyond, the next run takes care."""


class MqttOutlet(Outlet):
    """Raises SettingsError for what cannot be tried: a library, a password or a certificate that is not there."""

    def __init__(self, settings: MqttSettings, complain: Callable[[str], None]) -> None:
        super().__init__("mqtt", complain, int(settings.every * 1e9))
        try:
            import aiomqtt  # noqa: F401
        except ImportError:
            raise SettingsError("MQTT needs a library: pip install 'sniff485[mqtt]'") from None
        self._settings = settings
        self._password = settings.password.read()
        self._context = _tls(settings) if settings.tls else None
        self._messages = Messages(settings.prefix, settings.discovery)
        self._kept: dict[str, bytes] = {}  # what is retained, the newest of each topic
        self._unsent: dict[str, bool] = {}  # topics whose newest the broker lacks; True: nobody ever got it
        self._events: deque[Publication] = deque()
        self.connected = False
        self.where = f"mqtt{'s' if settings.tls else ''}://{settings.host}:{settings.port}"
        self._loop: asyncio.AbstractEventLoop | None = None
        self._news = asyncio.Event()
        self._behind = False  # whether what newer things replace is lost to whoever listens at the broker

    def _wake(self) -> None:
        loop = self._loop
        if loop is not None:
            with contextlib.suppress(RuntimeError):  # closed meanwhile
                loop.call_soon_threadsafe(self._news.set)

    def close(self, patience: float = AT_THE_END) -> None:
        """Deliver what waits, as far as the broker takes it."""
        super().close(patience)
        self.dropped += sum(self._unsent.values()) + len(self._events)

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:  # the library wants to watch sockets
            self._loop = runner.get_loop()
            try:
                runner.run(self._connect_again_and_again())
            finally:
                self._loop = None

    async def _connect_again_and_again(self) -> None:
        from aiomqtt import MqttError

        failures = 0
        while True:
            try:
                async with self._client() as client:
                    failures = 0
                    self._fare("")
                    await self._serve(client)
                    return
            except (MqttError, OSError, TimeoutError) as error:
                self._behind = True
                self._fare(f"{self._where}: {sanitized(_reason(error))}")
            if self._closing:
                return
            await self._wait(BACKOFF[min(failures, len(BACKOFF) - 1)])
            failures += 1
            if self._closing:
                return

    @property
    def _where(self) -> str:
        return f"{self._settings.host}:{self._settings.port}"

    def _client(self) -> Client:
        import aiomqtt

        settings = self._settings
        logger = logging.getLogger("sniff485.mqtt")
        logger.addHandler(logging.NullHandler())
        logger.propagate = False  # what goes wrong is said in one line
        return aiomqtt.Client(
            settings.host,
            settings.port,
            username=settings.user or None,
            password=self._password,
            identifier=settings.client_id or f"sniff485-{secrets.token_hex(6)}",
            will=aiomqtt.Will(self._messages.status_topic, OFFLINE, 1, True),
            tls_context=self._context,
            timeout=PATIENCE,
            keepalive=30,
            max_queued_incoming_messages=MOST_INCOMING,
            max_queued_outgoing_messages=2 * WINDOW,
            max_inflight_messages=WINDOW,
            max_concurrent_outgoing_calls=2 * WINDOW,
            logger=logger,
        )

    async def _wait(self, seconds: float) -> None:
        """Let time pass; what is told meanwhile is taken in."""
        until = asyncio.get_running_loop().time() + seconds
        while not self._closing and (left := until - asyncio.get_running_loop().time()) > 0:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), left)
            self._news.clear()
            self._absorb()

    async def _serve(self, client: Client) -> None:
        """Tell a broker everything that stands, then what is new, until the end."""
        await client.publish(self._messages.status_topic, ONLINE, 1, True)
        for topic in self._kept:
            self._unsent.setdefault(topic, False)
        reading = asyncio.ensure_future(self._read(client))
        reading.add_done_callback(lambda done: done.cancelled() or done.exception())  # whoever delivers finds it too
        looking = _Looking()
        try:
            while True:
                self._news.clear()
                took = self._absorb()
                await looking.go_on(client, self._messages.leftovers)
                await self._deliver(client)
                self._behind = self._behind and took == TAKEN_AT_ONCE
                if self._closing and not took:
                    break
                if not took:
                    await self._until_news(reading, looking.left)
            for publication in self._messages.at_the_end():
                self._keep(publication)
            await self._deliver(client)
            await client.publish(self._messages.status_topic, OFFLINE, 1, True)
        finally:
            reading.cancel()

    async def _read(self, client: Client) -> None:
        """Take away what a run before left; ends by raising, with the connection."""
        async for message in client.messages:
            topic = str(message.topic)
            if message.retain and message.payload and topic not in self._kept:
                self._keep(Publication(topic, b""))
                self._news.set()

    async def _until_news(self, reading: asyncio.Future[None], seconds: float | None) -> None:
        """Wait for something to tell, so many seconds at most, or for the connection to end, which raises."""
        news = asyncio.ensure_future(self._news.wait())
        either: set[asyncio.Future[Any]] = {news, reading}
        try:
            done, _ = await asyncio.wait(either, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
            if reading in done:
                reading.result()
        finally:
            news.cancel()

    def _absorb(self) -> int:
        """Take what was told, and see what of it has to be sent; how many things it was."""
        told = self._take(TAKEN_AT_ONCE)
        before = self._messages.dropped
        for one in told:
            for publication in self._messages.of(one):
                self._keep(publication)
        self.dropped += self._messages.dropped - before
        return len(told)

    def _keep(self, publication: Publication) -> None:
        if len(publication.payload) > MOST_PAYLOAD:
            self.dropped += 1
            return
        if publication.retain:
            if self._kept.get(publication.topic) == publication.payload:
                return
            self.dropped += self._behind and self._unsent.get(publication.topic, False)
            self._kept[publication.topic] = publication.payload
            self._unsent[publication.topic] = True
            return
        self._events.append(publication)
        if len(self._events) > MOST_EVENTS:
            self._events.popleft()
            self.dropped += 1

    async def _deliver(self, client: Client) -> None:
        """Send what is unsent, a window at a time. Raises what the first failure was; what was not taken stays."""
        while self._unsent or self._events:
            topics = list(self._unsent)[:WINDOW]
            window = [Publication(topic, self._kept[topic]) for topic in topics]
            events = [self._events[at] for at in range(min(WINDOW - len(window), len(self._events)))]
            results = await asyncio.gather(
                *(client.publish(one.topic, one.payload, 1, one.retain, timeout=PATIENCE) for one in window + events),
                return_exceptions=True,
            )
            for one, result in zip(window, results, strict=False):
                if result is None:
                    del self._unsent[one.topic]
                    if not one.payload:
                        del self._kept[one.topic]  # it is over, and the broker knows
            left = [one for one, result in zip(events, results[len(window) :], strict=True) if result is not None]
            for _ in events:
                self._events.popleft()
            self._events.extendleft(reversed(left))
            self.sent += sum(result is None for result in results)
            failed = next((result for result in results if result is not None), None)
            if failed is not None:
                raise failed


class _Looking:
    """Asks a broker, on one connection, for what it kept of some topics, and then for nothing any more."""

    def __init__(self) -> None:
        self._asked: set[str] = set()
        self._until: float | None = None

    @property
    def left(self) -> float | None:
        """Seconds until it is over; None: it is."""
        return None if self._until is None else max(0.0, self._until - asyncio.get_running_loop().time())

    async def go_on(self, client: Client, patterns: frozenset[str]) -> None:
        """Ask for what was not asked for yet; a broker that does not tell is none that keeps us from telling."""
        from aiomqtt import MqttCodeError

        with contextlib.suppress(MqttCodeError):
            for pattern in patterns - self._asked:
                self._asked.add(pattern)
                self._until = asyncio.get_running_loop().time() + LOOKED_FOR
                await client.subscribe(pattern, 1, timeout=PATIENCE)
            if self.left == 0:
                self._until = None
                await client.unsubscribe(sorted(self._asked), timeout=PATIENCE)


def _tls(settings: MqttSettings) -> ssl.SSLContext:
    try:
        context = ssl.create_default_context(cafile=settings.ca or None)
        if settings.certificate:
            context.load_cert_chain(settings.certificate, settings.key)
    except OSError as error:  # ssl.SSLError is one
        paths = ", ".join(path for path in (settings.ca, settings.certificate, settings.key) if path)
        raise SettingsError(f"{paths}: {error.strerror or error.args[-1]}") from None
    return context


def _reason(error: BaseException) -> str:
    """The cause in words; a library's own words are often only about its call."""
    cause = error
    while cause.__cause__ is not None:
        cause = cause.__cause__
    return str(cause) or str(error) or type(cause).__name__
