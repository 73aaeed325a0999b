// One tab votes at a time. Without Web Locks (plain http to another machine) nothing is held: the
// server keeps two tabs apart in any case.
// A page that is being left may still hold it.
const PATIENCE_MS = 600;

// Whether this tab may vote now; lost() is called when another tab takes over. A browser that is
// slow to answer says nothing of other tabs: only who holds it does.
export function hold(name, lost, { steal = false } = {}) {
  const { locks } = navigator;
  if (!locks) return Promise.resolve(true);
  const waiting = new AbortController();
  const isTaken = async () => (await locks.query()).held.some((lock) => lock.name === name);
  return new Promise((resolve) => {
    let isHeld = false;
    const tillTheEnd = () => {
      isHeld = true;
      resolve(true);
      return new Promise(() => {});
    };
    locks.request(name, steal ? { steal } : { signal: waiting.signal }, tillTheEnd).catch(() => (isHeld ? lost() : resolve(false)));
    // Who holds it by then keeps it: an abort is too late for a lock that is given.
    if (!steal) isTaken().then(() => setTimeout(async () => (await isTaken()) && waiting.abort(), PATIENCE_MS));
  });
}
