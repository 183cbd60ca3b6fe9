//! How requests reach a server and how much of an answer is taken: not a byte more than was asked
//! for, and nothing from another server unless the user allowed it.

use bytes::Bytes;
use object_store::{
    ClientConfigKey as Key, ClientOptions,
    client::{
        HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse, HttpService,
    },
};
use reqwest::{
    Url,
    header::{CONTENT_LENGTH, CONTENT_RANGE, HeaderMap, RANGE},
    redirect::{Action, Attempt, Policy},
};
use std::{
    error::Error,
    fmt,
    pin::Pin,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    time::Duration,
};

/// Most bytes of an answer to a request without a range, such as one for credentials.
const MOST: u64 = 1 << 20;

/// Bytes that are read of an answer that is an error, for its message.
const REASON: u64 = 4 << 10;

/// Most redirects from a request to its answer.
const REDIRECTS: usize = 10;

static ALLOWED: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Sets the servers to which redirects may lead, for inputs that are opened from now on: hosts
/// (`data.example.org`), or hosts with ports (`data.example.org:8443`). A redirect within the
/// server of an address is always followed, any other only to these.
pub fn allow_redirects(hosts: impl IntoIterator<Item = String>) {
    *ALLOWED.lock().unwrap_or_else(PoisonError::into_inner) = hosts.into_iter().collect();
    super::forget_opened();
}

/// Why an answer was not taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Refused {
    /// Asked for a part, the server answers with this status instead of 206.
    NotPartial { status: u16 },
    /// The server announces this many bytes where fewer were asked for.
    Announced { bytes: u64, most: u64 },
    /// The server sends more bytes than it was asked for, or than it announced.
    TooLong { most: u64 },
    /// A redirect to this server, which the user has not allowed.
    Redirect { to: String },
    /// A redirect from `https` to `http`.
    Unencrypted { to: String },
    /// More redirects than any address needs.
    Endless,
    /// A redirect without an address, or to one that is none.
    Nowhere { status: u16 },
}

impl Refused {
    /// Returns the refusal among the causes of an error.
    pub fn of<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a Self> {
        let mut cause = Some(error);
        while let Some(error) = cause {
            if let Some(refused) = error.downcast_ref() {
                return Some(refused);
            }
            cause = error.source();
        }
        None
    }

    /// What the user can do.
    pub fn hint(&self) -> String {
        match self {
            Self::Redirect { to } => format!("if you trust it, add --allow-host {to}"),
            Self::Unencrypted { .. } => "use an address that is encrypted to its end".into(),
            Self::NotPartial { .. } => {
                "download the file and give its path, or use a server that supports ranges".into()
            }
            Self::Announced { .. } | Self::TooLong { .. } => {
                "the server does not do what was asked: download the file and give its path".into()
            }
            Self::Endless | Self::Nowhere { .. } => "check the address".into(),
        }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NotPartial { status: 200 } => out.write_str(
                "the server does not support ranges: asked for a part, it sent the whole object \
                 (200 instead of 206)",
            ),
            Self::NotPartial { status } => write!(
                out,
                "the server does not support ranges: asked for a part, it answered with the \
                 status {status} instead of 206"
            ),
            Self::Announced { bytes, most } => {
                write!(out, "the server was asked for {most} bytes and announces {bytes}")
            }
            Self::TooLong { most } => {
                write!(out, "the server sends more than the {most} bytes that were asked for")
            }
            Self::Redirect { to } => {
                write!(out, "the server redirects to another one, {to}, which is not followed")
            }
            Self::Unencrypted { to } => {
                write!(out, "the server redirects to {to} without encryption")
            }
            Self::Endless => write!(out, "the server redirects more than {REDIRECTS} times"),
            Self::Nowhere { status } => {
                write!(out, "the server redirects without saying where ({status})")
            }
        }
    }
}

impl Error for Refused {}

/// Makes clients that keep to these rules.
#[derive(Debug, Clone)]
pub(super) struct Connector {
    /// Counts the bytes that come.
    pub came: Arc<AtomicU64>,
}

impl HttpConnector for Connector {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        let client = client(options)
            .map_err(|error| object_store::Error::Generic { store: "HTTP", source: error })?;
        Ok(HttpClient::new(Service { client, came: self.came.clone() }))
    }
}

/// The options of a client that the environment and `fetch.rs` can set.
const OPTIONS: [Key; 9] = [
    Key::AllowHttp,
    Key::ProxyUrl,
    Key::ProxyExcludes,
    Key::ProxyCaCertificate,
    Key::UserAgent,
    Key::AllowInvalidCertificates,
    Key::ConnectTimeout,
    Key::ReadTimeout,
    Key::Timeout,
];

/// Most clients that are kept.
const MOST_CLIENTS: usize = 16;

/// Clients, by their options.
static CLIENTS: Mutex<Vec<(Vec<Option<String>>, reqwest::Client)>> = Mutex::new(Vec::new());

/// Returns a client with these options. Objects share them, and so their connections.
fn client(options: &ClientOptions) -> Result<reqwest::Client, Box<dyn Error + Send + Sync>> {
    if options.get_default_headers().is_some() {
        return build(options);
    }
    let values: Vec<Option<String>> =
        OPTIONS.iter().map(|key| options.get_config_value(key)).collect();
    let mut clients = CLIENTS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, client)) = clients.iter().find(|(known, _)| *known == values) {
        return Ok(client.clone());
    }
    let client = build(options)?;
    clients.truncate(MOST_CLIENTS - 1);
    clients.insert(0, (values, client.clone()));
    Ok(client)
}

/// Builds a client.
fn build(options: &ClientOptions) -> Result<reqwest::Client, Box<dyn Error + Send + Sync>> {
    let text = |key: Key| options.get_config_value(&key).filter(|text| !text.is_empty());
    let is_set = |key: Key| text(key).is_some_and(|text| text == "true");
    let mut builder = reqwest::Client::builder()
        .user_agent(concat!("splatkit/", env!("CARGO_PKG_VERSION")))
        .redirect(Policy::custom(redirected))
        .https_only(!is_set(Key::AllowHttp));
    if let Some(proxy) = text(Key::ProxyUrl) {
        let mut proxy = reqwest::Proxy::all(proxy)?;
        if let Some(excludes) = text(Key::ProxyExcludes) {
            proxy = proxy.no_proxy(reqwest::NoProxy::from_string(&excludes));
        }
        builder = builder.proxy(proxy);
        if let Some(certificate) = text(Key::ProxyCaCertificate) {
            let certificate = reqwest::tls::Certificate::from_pem(certificate.as_bytes())?;
            builder = builder.tls_certs_merge([certificate]);
        }
    }
    if let Some(headers) = options.get_default_headers() {
        builder = builder.default_headers(headers.clone());
    }
    if let Some(agent) = text(Key::UserAgent) {
        builder = builder.user_agent(agent);
    }
    if is_set(Key::AllowInvalidCertificates) {
        builder = builder.tls_danger_accept_invalid_certs(true);
    }
    // Written by `fetch.rs` in milliseconds, or by object_store.
    if let Some(time) = text(Key::ConnectTimeout).and_then(|text| time_of(&text)) {
        builder = builder.connect_timeout(time);
    }
    if let Some(time) = text(Key::ReadTimeout).and_then(|text| time_of(&text)) {
        builder = builder.read_timeout(time);
    }
    if let Some(time) = text(Key::Timeout).and_then(|text| time_of(&text)) {
        builder = builder.timeout(time);
    }
    Ok(builder.build()?)
}

/// Reads a time as options give it: `300ms`, `300 ms`, `1.5s`.
fn time_of(text: &str) -> Option<Duration> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let number: f64 = text[..end].parse().ok()?;
    let unit = match text[end..].trim() {
        "µs" | "us" => 1e-6,
        "ms" => 1e-3,
        "s" | "" | "seconds" | "second" | "sec" => 1.0,
        "m" | "min" | "minutes" => 60.0,
        _ => return None,
    };
    Duration::try_from_secs_f64(number * unit).ok()
}

/// Decides whether a redirect is followed.
fn redirected(attempt: Attempt) -> Action {
    let (to, before) = (attempt.url(), attempt.previous());
    let Some(last) = before.last() else { return attempt.stop() };
    let name = server(to);
    if before.len() > REDIRECTS {
        return attempt.error(Refused::Endless);
    }
    if last.scheme() == "https" && to.scheme() != "https" {
        return attempt.error(Refused::Unencrypted { to: name });
    }
    let first = before.first().unwrap_or(last);
    let is_within = to.host_str() == first.host_str()
        && (to.port() == first.port())
        && (to.scheme() == first.scheme() || to.scheme() == "https");
    let allowed = ALLOWED.lock().unwrap_or_else(PoisonError::into_inner);
    let host = to.host_str().unwrap_or_default();
    let is_allowed = allowed
        .iter()
        .any(|entry| entry.eq_ignore_ascii_case(&name) || entry.eq_ignore_ascii_case(host));
    drop(allowed);
    if !(is_within || is_allowed) {
        return attempt.error(Refused::Redirect { to: name });
    }
    if !is_within {
        tracing::info!("{} redirects to {name}", server(last));
    }
    attempt.follow()
}

/// Returns the server of an address, with its port if that is not the usual one. Never the path
/// and the query, which may be secret.
fn server(url: &Url) -> String {
    let Some(host) = url.host_str() else { return format!("{}:", url.scheme()) };
    url.port().map_or(host.to_owned(), |port| format!("{host}:{port}"))
}

#[derive(Debug)]
struct Service {
    client: reqwest::Client,
    came: Arc<AtomicU64>,
}

type Answer<'a> = Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'a>>;

impl HttpService for Service {
    fn call<'service, 'answer>(&'service self, request: HttpRequest) -> Answer<'answer>
    where
        'service: 'answer,
        Self: 'answer,
    {
        Box::pin(self.answer(request))
    }
}

impl Service {
    async fn answer(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let (parts, body) = request.into_parts();
        let url: Url = parts.uri.to_string().parse().map_err(|error| {
            HttpError::new_boxed(HttpErrorKind::Unknown, Box::new(Wrong(error)))
        })?;
        let asked = asked(&parts.headers);
        let mut request = reqwest::Request::new(parts.method, url);
        *request.headers_mut() = parts.headers;
        *request.body_mut() = body.as_bytes().cloned().map(reqwest::Body::from);
        let mut answer = self.client.execute(request).await.map_err(failed)?;
        let status = answer.status();
        if status.is_redirection() && status.as_u16() != 304 {
            return Err(refused(Refused::Nowhere { status: status.as_u16() }));
        }
        if asked.is_some() && status.is_success() && status.as_u16() != 206 {
            return Err(refused(Refused::NotPartial { status: status.as_u16() }));
        }
        let body = match asked {
            _ if !status.is_success() => self.taken(&mut answer, REASON, true).await?,
            Some(asked) => {
                let most = announced(answer.headers()).map_or(asked, |bytes| bytes.min(asked));
                self.taken(&mut answer, most, false).await?
            }
            None => self.taken(&mut answer, MOST, false).await?,
        };
        let length = body.len();
        let mut taken = HttpResponse::new(body.into());
        *taken.status_mut() = status;
        *taken.headers_mut() = answer.headers().clone();
        // The store requires one, but a server may mark the end of a body otherwise.
        taken.headers_mut().insert(CONTENT_LENGTH, length.into());
        Ok(taken)
    }

    /// Reads the body of an answer. More bytes than `most` are an error, or left unread if the body
    /// may be cut.
    async fn taken(
        &self,
        answer: &mut reqwest::Response,
        most: u64,
        may_be_cut: bool,
    ) -> Result<Bytes, HttpError> {
        if let Some(bytes) = answer.content_length().filter(|bytes| *bytes > most && !may_be_cut) {
            return Err(refused(Refused::Announced { bytes, most }));
        }
        let mut all = Vec::new();
        while let Some(part) = answer.chunk().await.map_err(failed)? {
            self.came.fetch_add(part.len() as u64, Relaxed);
            let room = (most - all.len() as u64) as usize;
            all.extend_from_slice(&part[..part.len().min(room)]);
            if part.len() > room {
                if may_be_cut {
                    break;
                }
                return Err(refused(Refused::TooLong { most }));
            }
        }
        Ok(all.into())
    }
}

/// An address that is none, although one was made of it before.
#[derive(Debug)]
struct Wrong(<Url as std::str::FromStr>::Err);

impl fmt::Display for Wrong {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(out)
    }
}

impl Error for Wrong {}

/// Returns how many bytes a request asks for: `bytes=5-9`.
fn asked(headers: &HeaderMap) -> Option<u64> {
    let range = headers.get(RANGE)?.to_str().ok()?;
    length(range.strip_prefix("bytes=")?)
}

/// Returns how many bytes of the object an answer says that it has: `bytes 5-9/100`.
fn announced(headers: &HeaderMap) -> Option<u64> {
    let range = headers.get(CONTENT_RANGE)?.to_str().ok()?;
    length(range.strip_prefix("bytes ")?.split('/').next()?)
}

/// Returns the length of a range: `5-9`.
fn length(range: &str) -> Option<u64> {
    let (start, end) = range.split_once('-')?;
    let (start, end): (u64, u64) = (start.trim().parse().ok()?, end.trim().parse().ok()?);
    end.checked_sub(start)?.checked_add(1)
}

/// An error that asking again does not help.
fn refused(why: Refused) -> HttpError {
    HttpError::new(HttpErrorKind::Decode, why)
}

/// Says of a failed request whether asking again may help.
fn failed(error: reqwest::Error) -> HttpError {
    let kind = if Refused::of(&error).is_some() || error.is_redirect() || error.is_builder() {
        HttpErrorKind::Decode
    } else if error.is_timeout() {
        HttpErrorKind::Timeout
    } else if error.is_connect() {
        HttpErrorKind::Connect
    } else {
        HttpErrorKind::Interrupted
    };
    // The address may hold secrets.
    HttpError::new(kind, error.without_url())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read() {
        let times = ["300 ms", "1.5s", "2", "x", ""].map(time_of);
        let wanted = [Some(300), Some(1500), Some(2000), None, None];
        assert_eq!(times, wanted.map(|time| time.map(Duration::from_millis)));
    }

    #[test]
    fn ranges_have_lengths() {
        assert_eq!(
            ["5-9", "0-0", "9-5", "a-b", "5"].map(length),
            [Some(5), Some(1), None, None, None]
        );
        assert_eq!(length(&format!("0-{}", u64::MAX)), None);
    }
}
