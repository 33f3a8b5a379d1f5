// Finds out why a WebSocket didn't open, which browsers hide from pages. The same address answers
// plain requests, too.

/**
 * `isFinal`: another attempt would fail as well. An empty cause: there is no answer.
 * @typedef {{isFinal: boolean, cause: string}} Reason
 */

const MOST_CHARACTERS = 300;

/**
 * @param {URL} stream the address of the server's stream, with the scheme of plain requests
 * @param {string} origin this page's
 * @returns {Promise<Reason>}
 */
export async function reasonOf(stream, origin) {
  const url = new URL(stream);
  url.search = new URLSearchParams({origin}).toString();
  try {
    const reply = await fetch(url, {cache: "no-store", redirect: "manual", headers: {Accept: "text/plain"}});
    if (reply.status === 403) {
      const isText = (reply.headers.get("Content-Type") ?? "").startsWith("text/plain");
      const text = isText ? (await reply.text()).slice(0, MOST_CHARACTERS).replace(/\s+/g, " ").trim() : "";
      return {isFinal: true, cause: text ? `the server refuses this page: ${text}` : "something before the server refuses this page (HTTP status 403)"};
    }
    if (reply.status === 426) return {isFinal: false, cause: "the server answers, but something before it passes no WebSockets on"};
    if (reply.type === "opaqueredirect" || reply.status === 401) return {isFinal: false, cause: "something before the server wants a login; reload this page"};
    if (reply.status >= 502 && reply.status <= 504) return {isFinal: false, cause: `the proxy can't reach the server (HTTP status ${reply.status})`};
    return {isFinal: false, cause: `the stream's address answers with HTTP status ${reply.status}`};
  } catch {  // no answer
    return {isFinal: false, cause: ""};
  }
}
