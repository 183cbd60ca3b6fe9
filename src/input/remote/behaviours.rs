//! What servers may do, each against a clock and a count of bytes: an error that says what came.

use super::super::transport::allow_redirects;
use super::server::{Fault, Server, Then};
use super::*;
use Then::{Bytes as More, Drip, End, Endless, Silence};

/// What is asked for, and what the server says of it.
const HEAD: &str = "HTTP/1.1 206 P\r\nETag: \"a\"\r\nContent-Range: bytes 0-262143/2000000\r\n";

/// A name, what is sent, what follows, and words of the message.
type Case = (&'static str, String, Then, &'static str);

fn with(lines: &str) -> String {
    format!("{HEAD}{lines}\r\n")
}

fn status(line: &str) -> String {
    format!("HTTP/1.1 {line}\r\n\r\n")
}

fn ranged(range: &str) -> String {
    format!("HTTP/1.1 206 P\r\nETag: \"a\"\r\nContent-Range: {range}\r\nContent-Length: 9\r\n\r\n")
}

/// Bodies of another length than was asked for.
fn lengths() -> Vec<Case> {
    let short = "HTTP/1.1 206 P\r\nContent-Range: bytes 0-99/100\r\n\r\n";
    let all = FIRST as usize;
    vec![
        (
            "endless, announced",
            with("Content-Length: 4611686018427387904\r\n"),
            Endless,
            "asked for 262144 bytes and announces 4611686018427387904",
        ),
        ("endless", with(""), Endless, "sends more than the 262144 bytes"),
        (
            "endless chunk",
            with("Transfer-Encoding: chunked\r\n") + "7fffffff\r\n",
            Endless,
            "sends more than the 262144 bytes",
        ),
        (
            "one too many, announced",
            with("Content-Length: 262145\r\n"),
            More(all + 1),
            "announces 262145",
        ),
        ("one too many", with(""), More(all + 1), "sends more than the 262144 bytes"),
        ("more than the range", short.into(), More(101), "sends more than the 100 bytes"),
        ("cut", with("Content-Length: 262144\r\n"), More(100), "the server cannot be read"),
        ("short", with(""), More(10), "asked for 262144 bytes and sent 10"),
        ("empty", with("Content-Length: 0\r\n"), End, "asked for 262144 bytes and sent 0"),
        (
            "cut chunk",
            with("Transfer-Encoding: chunked\r\n") + "40\r\n",
            More(9),
            "the server cannot be read",
        ),
        (
            "broken chunk",
            with("Transfer-Encoding: chunked\r\n") + "zz\r\n",
            Endless,
            "the server cannot be read",
        ),
        ("negative length", with("Content-Length: -1\r\n"), Endless, "the server cannot be read"),
        (
            "two lengths",
            with("Content-Length: 9\r\nContent-Length: 262144\r\n"),
            Endless,
            "the server cannot be read",
        ),
    ]
}

/// Statuses other than 206, with bodies of any length.
fn statuses() -> Vec<Case> {
    vec![
        ("whole, endless", status("200 OK"), Endless, "the whole object (200 instead of 206)"),
        ("no content", status("204 None"), End, "the status 204 instead of 206"),
        ("404, endless", status("404 None"), Endless, "there is no such object (404)"),
        ("401", status("401 Who"), End, "refuses access"),
        ("403, endless", status("403 No"), Endless, "refuses access"),
        ("416", status("416 Range"), End, "416"),
        ("418", status("418 Teapot"), Endless, "418"),
        ("429", status("429 Often"), End, "429"),
        ("500, endless", status("500 Broken"), Endless, "500"),
        ("503, dripping", status("503 Busy"), Drip(50), "bytes came) takes longer than"),
    ]
}

/// Redirects that are not followed.
fn redirects() -> Vec<Case> {
    let to = |status: u16, place: &str| {
        format!("HTTP/1.1 {status} Moved\r\nLocation: {place}\r\nConnection: close\r\n\r\n")
    };
    vec![
        ("301, nowhere", status("301 Moved"), Endless, "without saying where (301)"),
        ("308, no address", to(308, "http://[::1"), End, "without saying where (308)"),
        (
            "302, elsewhere",
            to(302, "http://other.invalid/x?secret=hidden"),
            End,
            "redirects to another one, other.invalid, which is not followed; if you trust it, add \
             --allow-host other.invalid",
        ),
        (
            "307, another port",
            to(307, "http://127.0.0.1:1/x?hidden"),
            End,
            "another one, 127.0.0.1:1,",
        ),
        ("303, a file", to(303, "file:///etc/hostname"), End, "redirect"),
        ("301, in circles", to(301, "/again"), End, "redirects more than 10 times"),
    ]
}

/// Heads that contradict the request, or are none.
fn heads() -> Vec<Case> {
    vec![
        ("no range", "HTTP/1.1 206 P\r\n\r\n".into(), More(9), "Content-Range"),
        ("no size", ranged("bytes 0-262143/*"), More(9), "bytes 0-262143/*"),
        ("another range", ranged("bytes 5-262148/2000000"), More(9), "Requested 0..262144, got 5"),
        ("backwards", ranged("bytes 9-5/10"), More(9), "the server cannot be read"),
        ("range past the end", ranged("bytes 0-262143/5"), More(9), "the server cannot be read"),
        ("range of words", ranged("all"), More(9), "all"),
        ("another protocol", "SSH-2.0-OpenSSH_9.9\r\n".into(), Silence, "cannot be read"),
        ("nothing", String::new(), End, "cannot be read"),
        ("endless line", "HTTP/1.1 206 P\r\nX: ".into(), Endless, "cannot be read"),
        ("endless lines", "HTTP/1.1 206 P\r\n".to_owned() + &"X: y\r\n".repeat(9999), Endless, ""),
        ("escapes", with("X-\u{1b}[31m: red\r\n"), Endless, "cannot be read"),
        ("old", "HTTP/0.9 hello\r\n\r\n".into(), Endless, "cannot be read"),
    ]
}

/// Servers that keep the reader waiting.
fn slow() -> Vec<Case> {
    let late = "bytes came) takes longer than the limit of 1 s";
    vec![
        ("silent", String::new(), Silence, late),
        ("silent after the head", with("Content-Length: 262144\r\n"), Silence, late),
        ("dripping body", with("Content-Length: 262144\r\n"), Drip(50), late),
        ("dripping body without end", with(""), Drip(50), late),
        ("dripping head", "HTTP/1.1 206 P\r\nX: ".into(), Drip(50), late),
        ("dripping status", "H".into(), Drip(50), ""),
        ("for ever about to", "HTTP/1.1 100 Continue\r\n\r\n".repeat(20), Silence, late),
    ]
}

/// Servers that do not hurry are given time, except by the limit of seconds.
fn patient() -> Patience {
    let minute = Duration::from_secs(60);
    Patience { connect: minute, read: minute, answer: minute, ..impatient() }
}

/// Returns the message of a server's behaviour, and the bytes that were taken.
fn tried(head: String, then: Then, seconds: u64) -> (String, u64) {
    let server = Server::of(vec![0; 9]);
    let head: &'static str = head.leak();
    server.fail(move |_, _| Fault::Raw { head, then });
    let name = crate::input::address(server.address("a.splk?signature=hidden"));
    let link = Link::new(&name, patient()).unwrap();
    let first = 0..FIRST;
    let parts = link.parts(std::slice::from_ref(&first), None, Deadline::after(seconds));
    (error_text(parts), link.came())
}

#[test]
fn what_a_server_does_ends_soon_and_is_named() {
    let cases = [lengths(), statuses(), redirects(), heads(), slow()].concat();
    assert!(cases.len() >= 40, "{}", cases.len());
    let begun = Instant::now();
    std::thread::scope(|threads| {
        for (name, head, then, words) in cases {
            threads.spawn(move || {
                // Where nothing else ends it, the deadline does. The others end at once, but not
                // within a second on a busy machine.
                let is_slow = words.is_empty() || words.contains("takes longer");
                let seconds = if is_slow { 1 } else { 30 };
                let (message, came) = tried(head, then, seconds);
                assert!(message.contains(words), "{name}: {message}");
                assert!(message.contains("a.splk: "), "{name}: {message}");
                assert!(!message.contains("hidden"), "{name}: {message}");
                assert!(message.len() < 700 && !message.contains('\u{1b}'), "{name}: {message}");
                // What is in the buffers of the system when a part is read, once per try.
                assert!(came <= 3 * (FIRST + MIB), "{name}: {came} bytes");
            });
        }
    });
    // All at once; machines may be busy.
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
}

#[test]
fn redirects_are_followed_where_the_user_allows_it() {
    let bytes = object(1000);
    let (target, first) = (Server::of(bytes.clone()), Server::of(vec![0; 9]));
    let place = target.address("b.splk");
    let to = |place: &str| -> &'static str {
        format!("HTTP/1.1 302 Moved\r\nLocation: {place}\r\nConnection: close\r\n\r\n").leak()
    };
    let head = to(&place);
    first.fail(move |_, _| Fault::Raw { head, then: End });
    let open = |server: &Server| {
        let name = server.address("a.splk");
        opened(Path::new(&name), cache(&Folder::new(), 0))
    };
    let host = place.split('/').nth(2).unwrap().to_owned();
    let error = error_text(open(&first));
    assert!(error.contains(&format!("--allow-host {host}")), "{error}");
    assert!(target.asked().is_empty());
    allow_redirects([host]);
    let read = open(&first).unwrap().read(0..1000).unwrap();
    assert!(read[..] == bytes[..]);
    allow_redirects([]);
    assert!(error_text(open(&first)).contains("not followed"));
    // Within the server, nobody is asked.
    let head = to("/b.splk");
    target.fail(move |number, _| match number {
        0 => Fault::Raw { head, then: End },
        _ => Fault::None,
    });
    target.asked();
    assert_eq!(open(&target).unwrap().len(), 1000);
}

/// A size beyond every limit is no reason to allocate or to count past the end of numbers.
#[test]
fn huge_sizes_are_refused() {
    let head = "HTTP/1.1 206 P\r\nETag: \"a\"\r\n\
                Content-Range: bytes 0-262143/18446744073709551615\r\n\r\n";
    let server = Server::of(vec![0; 9]);
    server.fail(move |_, _| Fault::Raw { head, then: More(FIRST as usize) });
    let remote = open(&server, cache(&Folder::new(), 0)).unwrap();
    assert_eq!(remote.len(), u64::MAX);
    remote.read(u64::MAX - 9..u64::MAX).unwrap_err();
    // Neither does a list of all ranges fit in memory.
    remote.whole().unwrap_err();
}

/// The time for opening a file is for all of its requests together.
#[test]
fn opening_has_one_deadline() {
    let server = Server::of(object(2 << 20));
    let limits = Limits { seconds: 3, ..Limits::default() };
    let name = server.address("a.splk");
    let open = || {
        Remote::open_in(
            Path::new(&name),
            (cache(&Folder::new(), 0), patient()),
            &limits,
            Link::parts,
        )
    };
    let mut remote = open().unwrap();
    std::thread::sleep(Duration::from_millis(3100));
    let error = error_text(remote.read(MIB..MIB + 3));
    assert!(error.contains("takes longer than the limit of 3 s"), "{error}");
    remote.ready();
    assert!(remote.read(MIB..MIB + 3).is_ok());
}
