//! `splatkit serve`: shows a scene in a browser, from a server on this machine. The page is that of
//! `splatkit publish`. Hierarchies and bricks are read from the disk, part by part, as the page
//! asks for them; so is a folder that was published. The rest stays in memory.

use super::{PageFlags, answer::Answer, check_flags, page_of};
use crate::{failure::Failure, given::Given, output, progress::Progress, render::Render};
use clap::Args;
use hyper::{
    HeaderMap, Method, Request, Response, StatusCode,
    body::{Body, Bytes},
    header::{self, HeaderValue},
    server::conn::http1,
    service::service_fn,
};
use hyper_util::rt::TokioIo;
use splatkit::Error;
use splatkit_media::page::{Content, Viewer};
use std::{
    collections::BTreeMap,
    convert::Infallible,
    fs, io,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, SystemTime, UNIX_EPOCH},
};
use tokio::net::TcpListener;

/// How long the server waits after it could not take a connection.
const PAUSE: Duration = Duration::from_millis(100);

#[derive(Args, Debug)]
// A server writes no file.
#[command(
    mut_arg("output", |flag| flag.hide(true)),
    mut_arg("overwrite", |flag| flag.hide(true)),
    mut_arg("json", |flag| flag.hide(true)),
    mut_arg("depth", |flag| flag.hide(true)),
    mut_arg("layers", |flag| flag.hide(true)),
    mut_arg("turntable", |flag| flag.hide(true)),
    mut_arg("path", |flag| flag.hide(true)),
    mut_arg("times", |flag| flag.hide(true)),
    mut_arg("fps", |flag| flag.hide(true)),
    mut_arg("raw", |flag| flag.hide(true)),
    mut_arg("reference", |flag| flag.hide(true)),
    mut_arg("bits", |flag| flag.hide(true)),
    mut_arg("views", |flag| flag.hide(true)),
    mut_arg("split_channels", |flag| flag.hide(true)),
    mut_arg("columns", |flag| flag.hide(true)),
    mut_arg("panel_labels", |flag| flag.hide(true)),
    mut_arg("size", |flag| flag.hide(true)),
    mut_arg("width", |flag| flag.hide(true)),
    mut_arg("height", |flag| flag.hide(true)),
    mut_arg("dpi", |flag| flag.hide(true)),
    mut_arg("engine", |flag| flag.hide(true)),
)]
pub struct Serve {
    #[command(flatten)]
    scene: Render,
    #[command(flatten)]
    page: PageFlags,
    /// Listen at this address of the machine; 0.0.0.0 lets all look that reach the machine
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    #[arg(help_heading = "Server")]
    address: IpAddr,
    /// Listen at this port [default: one that is free]
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    #[arg(help_heading = "Server")]
    port: u16,
    /// Open no browser
    #[arg(long, help_heading = "Server")]
    no_open: bool,
}

/// The files of a page.
struct Files {
    /// By their paths.
    all: BTreeMap<String, Served>,
    /// What tells the bytes in memory from those of another run.
    tag: String,
}

/// A file that is served.
enum Served {
    Held(Bytes),
    /// A file on this machine, which is opened for each request.
    Kept(Content),
}

impl Files {
    fn new(all: impl IntoIterator<Item = (String, Content)>) -> Self {
        let served = |content| match content {
            Content::Held(bytes) => Served::Held(bytes.into()),
            file => Served::Kept(file),
        };
        let all = all.into_iter().map(|(name, content)| (name, served(content))).collect();
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { all, tag: format!("{:x}", now.as_nanos()) }
    }

    /// Opens a file: its bytes, and what tells them from others (an entity tag). `None` if there is
    /// no such file.
    fn open(&self, path: &str) -> Option<(Answer, String)> {
        match self.all.get(path)? {
            Served::Held(bytes) => Some((Answer::held(bytes.clone()), format!("\"{}\"", self.tag))),
            Served::Kept(content) => {
                let path = content.file()?;
                // Not what a link leads to, by now.
                path.symlink_metadata().ok().filter(|meta| meta.is_file())?;
                let file = fs::File::open(path).ok()?;
                let meta = file.metadata().ok()?;
                let written = meta.modified().unwrap_or(UNIX_EPOCH);
                let written = written.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
                let tag = format!("\"{:x}-{written:x}\"", meta.len());
                Some((Answer::of_file(file, meta.len()), tag))
            }
        }
    }
}

impl Serve {
    pub fn run(self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        if let Some(flag) = ["output", "overwrite", "json"].into_iter().find(|flag| given.has(flag))
        {
            return Err(Failure::Usage(format!(
                "--{flag}: `splatkit serve` writes no file; `splatkit publish` does"
            )));
        }
        check_flags(given)?;
        let files = match self.scene.inputs() {
            [folder] if folder.join("index.html").is_file() => published(folder)?,
            _ => {
                let job = self.scene.job(given)?;
                let viewer = Viewer::find(self.page.viewer.as_deref())?;
                let wish = self.page.wish();
                let page = page_of(&self.scene, &job, &viewer, (&wish, progress));
                let page = page.map_err(|failure| job.blamed(failure, &[]))?;
                Files::new(page.in_files(&viewer)?)
            }
        };
        progress.clear();
        let at = SocketAddr::new(self.address, self.port);
        serve(files, at, |at| self.tell(at, progress)).map_err(|error| {
            let message = format!("cannot listen at {at}: {error}");
            Failure::Usage(format!("{message}; give another --port or --address"))
        })
    }

    /// Says where the page is, and opens it.
    fn tell(&self, at: SocketAddr, progress: &Progress) {
        let host = if at.ip().is_unspecified() { Ipv4Addr::LOCALHOST.into() } else { at.ip() };
        let address = format!("http://{}/", SocketAddr::new(host, at.port()));
        output::line(format_args!("{address} until Ctrl-C")).ok();
        if !self.no_open
            && let Err(error) = open::that_detached(&address)
        {
            progress.note(format_args!("no browser could be opened: {error}"));
        }
    }
}

/// Returns the files of a folder that `splatkit publish` wrote.
fn published(folder: &Path) -> Result<Files, Failure> {
    let wrong = |path: &Path, error: io::Error| {
        Error::input(path, "page", format!("cannot be read: {error}"))
    };
    let (mut files, mut open) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = open.pop() {
        let path = folder.join(&inner);
        for entry in fs::read_dir(&path).map_err(|error| wrong(&path, error))? {
            let entry = entry.map_err(|error| wrong(&path, error))?;
            let (path, inner) = (entry.path(), inner.join(entry.file_name()));
            // Links are left out: they may lead to anything of the user's.
            match entry.file_type().map_err(|error| wrong(&path, error))? {
                kind if kind.is_dir() => open.push(inner),
                kind if kind.is_file() => {
                    let parts: Vec<_> = inner.iter().map(|part| part.to_string_lossy()).collect();
                    files.push((parts.join("/"), Content::Kept(path)));
                }
                _ => {}
            }
        }
    }
    Ok(Files::new(files))
}

/// Answers requests until the process ends. `ready` takes the address once it listens.
fn serve(files: Files, at: SocketAddr, ready: impl FnOnce(SocketAddr)) -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let files = Arc::new(files);
    runtime.block_on(async {
        let listener = TcpListener::bind(at).await?;
        let at = listener.local_addr()?;
        ready(at);
        loop {
            // The browser gave this one up, or too many are open.
            let Ok((stream, _)) = listener.accept().await else {
                tokio::time::sleep(PAUSE).await;
                continue;
            };
            let files = files.clone();
            let answer = service_fn(move |request| {
                let response = answered(&files, &request, at.ip().is_loopback());
                async move { Ok::<_, Infallible>(response) }
            });
            tokio::spawn(async move {
                let connection = http1::Builder::new();
                if let Err(error) = connection.serve_connection(TokioIo::new(stream), answer).await
                {
                    tracing::debug!("a connection ended: {error}");
                }
            });
        }
    })
}

/// Returns the answer to a request. A server for this machine alone refuses requests that name
/// another host: a foreign web page could send them through the user's browser.
fn answered<B: Body>(files: &Files, request: &Request<B>, is_local: bool) -> Response<Answer> {
    let headers = request.headers();
    if is_local && !is_of_this_machine(headers) {
        return said(StatusCode::FORBIDDEN, "this server answers this machine alone");
    }
    if ![Method::GET, Method::HEAD].contains(request.method()) {
        return said(StatusCode::METHOD_NOT_ALLOWED, "this server has files alone");
    }
    let path = percent_encoding::percent_decode_str(request.uri().path().trim_start_matches('/'));
    let path = path.decode_utf8_lossy();
    let path = if path.is_empty() { "index.html" } else { &*path };
    let Some((answer, tag)) = files.open(path) else {
        return said(StatusCode::NOT_FOUND, "there is no such file");
    };
    let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    if text(header::IF_MATCH).is_some_and(|tags| !names(tags, &tag)) {
        return said(StatusCode::PRECONDITION_FAILED, "the file has changed");
    }
    // A part of another file than the one that the client has would be of no use.
    let is_same = text(header::IF_RANGE).is_none_or(|known| known == tag);
    let mut response = part_of(answer, text(header::RANGE).filter(|_| is_same));
    if *request.method() == Method::HEAD {
        let length = response.body().size_hint().lower();
        *response.body_mut() = Answer::default();
        response.headers_mut().insert(header::CONTENT_LENGTH, length.into());
    }
    let kind = mime_guess::from_path(path).first_or_octet_stream();
    let headers = response.headers_mut();
    for (name, value) in [(header::CONTENT_TYPE, kind.as_ref()), (header::ETAG, &*tag)] {
        if let Ok(value) = HeaderValue::from_str(value) {
            headers.insert(name, value);
        }
    }
    headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

/// Returns whether a list of entity tags has this one. A weak tag is no match.
fn names(tags: &str, tag: &str) -> bool {
    tags.split(',').map(str::trim).any(|named| named == "*" || named == tag)
}

/// Returns a file, or the one part of it that a request asks for.
fn part_of(mut answer: Answer, range: Option<&str>) -> Response<Answer> {
    let length = answer.size_hint().lower();
    let Some(range) = range else { return Response::new(answer) };
    let Ok(parts) = http_range_header::parse_range_header(range)
        .map_err(drop)
        .and_then(|parsed| parsed.validate(length).map_err(drop))
    else {
        let mut response = said(StatusCode::RANGE_NOT_SATISFIABLE, "the file has no such part");
        if let Ok(value) = HeaderValue::from_str(&format!("bytes */{length}")) {
            response.headers_mut().insert(header::CONTENT_RANGE, value);
        }
        return response;
    };
    // Several parts at once may be answered by the whole.
    let [part] = &parts[..] else { return Response::new(answer) };
    let (start, end) = (*part.start(), *part.end());
    if answer.cut(start..end + 1).is_err() {
        return said(StatusCode::INTERNAL_SERVER_ERROR, "the file cannot be read");
    }
    let mut response = Response::new(answer);
    *response.status_mut() = StatusCode::PARTIAL_CONTENT;
    if let Ok(value) = HeaderValue::from_str(&format!("bytes {start}-{end}/{length}")) {
        response.headers_mut().insert(header::CONTENT_RANGE, value);
    }
    response
}

/// Returns whether a request names this machine as its host.
fn is_of_this_machine(headers: &HeaderMap) -> bool {
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next(),
        None => host.split(':').next(),
    };
    let name = name.unwrap_or_default();
    name == "localhost" || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

fn said(status: StatusCode, text: &'static str) -> Response<Answer> {
    let mut response = Response::new(Answer::held(Bytes::from_static(text.as_bytes())));
    *response.status_mut() = status;
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(files: &Files, path: &str, headers: &[(&str, &str)]) -> Response<Answer> {
        let mut request = Request::builder().uri(path).header("host", "localhost:1");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        answered(files, &request.body(Answer::default()).expect("a request"), true)
    }

    fn length(response: &Response<Answer>) -> u64 {
        response.body().size_hint().lower()
    }

    #[test]
    fn files_and_their_parts_are_answered() {
        let folder = tempfile::tempdir().expect("a folder");
        let kept = folder.path().join("a b.splk");
        let bytes: Vec<u8> = (0..1000).map(|at| (at % 251) as u8).collect();
        fs::write(&kept, &bytes).expect("a file");
        let files = Files::new([
            ("index.html".into(), Content::Held(b"<p>".to_vec())),
            ("a b.splk".into(), Content::Kept(kept.clone())),
        ]);
        let response = asked(&files, "/", &[]);
        assert_eq!((response.status(), length(&response)), (StatusCode::OK, 3));
        assert_eq!(response.headers()["content-type"], "text/html");
        let whole = asked(&files, "/a%20b.splk", &[]);
        assert_eq!(length(&whole), 1000);
        assert_eq!(whole.into_body().taken(), bytes);
        for (range, status, count) in [
            ("bytes=0-9", 206, 10),
            ("bytes=990-", 206, 10),
            ("bytes=-20", 206, 20),
            ("bytes=0-1,5-6", 200, 1000),
            ("bytes=1000-", 416, 25),
            ("bytes=9-3", 416, 25),
        ] {
            let response = asked(&files, "/a%20b.splk", &[("range", range)]);
            assert_eq!((response.status().as_u16(), length(&response)), (status, count), "{range}");
        }
        let part = asked(&files, "/a%20b.splk", &[("range", "bytes=-20")]);
        assert_eq!(part.headers()["content-range"], "bytes 980-999/1000");
        let tag = part.headers()["etag"].to_str().expect("a tag").to_owned();
        assert_eq!(part.into_body().taken(), bytes[980..]);
        let range = ("range", "bytes=5-9");
        for (name, value, status) in [
            ("if-match", &*tag, 206),
            ("if-match", "\"x\"", 412),
            ("if-range", &*tag, 206),
            ("if-range", "\"x\"", 200),
        ] {
            let response = asked(&files, "/a%20b.splk", &[range, (name, value)]);
            assert_eq!(response.status(), status, "{name}: {value}");
        }
        // Another file in its place, which is shorter.
        fs::write(&kept, [1; 10]).expect("a file");
        let changed = asked(&files, "/a%20b.splk", &[("if-match", &tag)]);
        assert_eq!(changed.status(), 412);
        assert_eq!(asked(&files, "/a%20b.splk", &[range]).into_body().taken(), [1; 5]);
        fs::remove_file(&kept).expect("no file");
        assert_eq!(asked(&files, "/a%20b.splk", &[]).status(), StatusCode::NOT_FOUND);
        assert_eq!(asked(&files, "/../secret", &[]).status(), StatusCode::NOT_FOUND);
    }

    #[test]
    fn others_are_refused() {
        let files = Files::new([("index.html".into(), Content::Held(Vec::new()))]);
        for (host, is_allowed) in [
            ("localhost:8000", true),
            ("127.0.0.1:8000", true),
            ("[::1]:8000", true),
            ("evil.example", false),
            ("192.168.0.7:8000", false),
            ("", false),
        ] {
            let request = Request::builder().uri("/").header("host", host);
            let request = request.body(Answer::default()).expect("a request");
            let allowed = answered(&files, &request, true).status() == StatusCode::OK;
            assert_eq!(allowed, is_allowed, "{host}");
            assert_eq!(answered(&files, &request, false).status(), StatusCode::OK, "{host}");
        }
    }
}
