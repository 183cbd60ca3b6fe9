//! Requests for ranges of an object: several at once, retried, and checked against its stamp.

use super::transport::{Connector, Refused};
use crate::{Deadline, Error, Result, input::address};
use bytes::Bytes;
use object_store::{
    BackoffConfig, ClientConfigKey, GetOptions, GetRange, ObjectStore, RetryConfig,
    aws::{AmazonS3Builder, AmazonS3ConfigKey},
    azure::{AzureConfigKey, MicrosoftAzureBuilder},
    gcp::{GoogleCloudStorageBuilder, GoogleConfigKey},
    http::HttpBuilder,
};
use std::{
    cell::Cell,
    collections::BTreeMap,
    ops::Range,
    path::{Path, PathBuf},
    sync::{
        Arc, LazyLock, Mutex, PoisonError, Weak,
        atomic::{AtomicU64, Ordering::Relaxed},
        mpsc,
    },
    time::Duration,
};
use tokio::{runtime::Runtime, sync::Semaphore, task::JoinSet};

/// Requests of this process to one server that run at once. A slow one does not keep others
/// waiting.
const IN_FLIGHT: usize = 8;

static REQUESTS: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicU64 = AtomicU64::new(0);

/// What this process has fetched so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traffic {
    /// The requests for ranges of bytes.
    pub requests: u64,
    /// The bytes that they returned.
    pub bytes: u64,
}

/// Returns what this process has fetched so far from remote inputs.
pub fn traffic() -> Traffic {
    Traffic { requests: REQUESTS.load(Relaxed), bytes: BYTES.load(Relaxed) }
}

/// How long a server may take, and how often it is asked again.
#[derive(Debug, Clone)]
pub(super) struct Patience {
    pub connect: Duration,
    /// From one part of an answer to the next.
    pub read: Duration,
    /// For a whole answer.
    pub answer: Duration,
    pub retries: usize,
    pub first_pause: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(10),
            read: Duration::from_secs(30),
            answer: Duration::from_secs(120),
            retries: 4,
            first_pause: Duration::from_millis(100),
        }
    }
}

/// What shows that an object has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stamp {
    pub size: u64,
    tag: Option<String>,
    /// Seconds since 1970; 0 if the server does not say.
    modified: i64,
}

impl Stamp {
    /// Whether more than the size would show a change.
    pub fn shows_changes(&self) -> bool {
        self.tag.is_some() || self.modified != 0
    }
}

/// An object on a server.
#[derive(Clone)]
pub(super) struct Link {
    store: Arc<dyn ObjectStore>,
    location: object_store::path::Path,
    name: PathBuf,
    patience: Patience,
    /// The bytes that came.
    came: Arc<AtomicU64>,
    /// The requests to its server that may begin.
    turns: Arc<Semaphore>,
}

/// Returns the turns that all objects of a server share.
fn turns_of(server: String) -> Arc<Semaphore> {
    static SERVERS: Mutex<BTreeMap<String, Weak<Semaphore>>> = Mutex::new(BTreeMap::new());
    let mut servers = SERVERS.lock().unwrap_or_else(PoisonError::into_inner);
    servers.retain(|_, turns| turns.strong_count() > 0);
    servers.get(&server).and_then(Weak::upgrade).unwrap_or_else(|| {
        let turns = Arc::new(Semaphore::new(IN_FLIGHT));
        servers.insert(server, Arc::downgrade(&turns));
        turns
    })
}

/// Why a range could not be fetched.
enum Trouble {
    /// The store has repeated the request, if that may help.
    Store(object_store::Error),
    /// The answer has only this many bytes.
    Short(u64),
}

/// How fetching several ranges ended.
enum Ended {
    Done(Vec<(Stamp, Bytes)>),
    Failed(Range<u64>, Trouble),
    /// The deadline has passed.
    Late,
    /// A thread panicked.
    Abandoned,
}

impl Link {
    pub fn new(name: &Path, patience: Patience) -> Result<Self> {
        let whole = address::whole(name).map_err(|why| Error::input(name, "address", why))?;
        let redacted = address::address(name);
        let wrong = |message: String| Error::input(&redacted, "address", message);
        let (scheme, rest) = whole.split_once("://").unwrap_or_default();
        let (host, key) = rest.split_once('/').unwrap_or((rest, ""));
        if scheme.starts_with("http") && host.contains('@') {
            let message = "contains a name or a password, which are not sent";
            return Err(wrong(message.into()).hint("use an address that is signed in its query"));
        }
        if redacted != name {
            return Err(wrong("contains a query, which may be secret".into())
                .hint("open the path that splatkit::input::address returns"));
        }
        let came = Arc::new(AtomicU64::new(0));
        let connector = Connector { came: came.clone() };
        let opened = open(scheme, &whole, [host, key], &patience, connector);
        let (store, location) = opened.map_err(|error| {
            wrong(format!("cannot be used: {}", innermost(&error)))
                .hint("the form is https://host/path, s3://bucket/key, gs://… or az://…")
        })?;
        let turns = turns_of(format!("{scheme}://{host}"));
        Ok(Self { store, location, name: name.to_owned(), patience, came, turns })
    }

    /// Fetches ranges at once, and returns their bytes in the same order, with the stamp of the
    /// object that they are of.
    pub fn parts(
        &self,
        ranges: &[Range<u64>],
        expected: Option<&Stamp>,
        deadline: Deadline,
    ) -> Result<(Stamp, Vec<Bytes>)> {
        self.parts_if_there(ranges, expected, deadline, &Cell::new(false))
    }

    /// As [`parts`](Self::parts). An error sets `is_absent` if the server says that there is no
    /// such object, or refuses access to it.
    pub fn parts_if_there(
        &self,
        ranges: &[Range<u64>],
        expected: Option<&Stamp>,
        deadline: Deadline,
        is_absent: &Cell<bool>,
    ) -> Result<(Stamp, Vec<Bytes>)> {
        let before = self.came.load(Relaxed);
        let left = deadline.left();
        let parts = match wait(self.clone().fetched(ranges.to_vec(), left)) {
            Some(Ended::Done(parts)) => parts,
            Some(Ended::Failed(range, trouble)) => {
                use object_store::Error as E;
                is_absent.set(matches!(
                    trouble,
                    Trouble::Store(E::NotFound { .. } | E::PermissionDenied { .. })
                ));
                return Err(self.explained(&range, &trouble));
            }
            Some(Ended::Late) => {
                let came = self.came.load(Relaxed).saturating_sub(before);
                let place = |range: &Range<u64>| format!("bytes {} to {}", range.start, range.end);
                let places: Vec<String> = ranges.iter().take(3).map(place).collect();
                let more = if ranges.len() > 3 { ", …" } else { "" };
                let what = format!("fetching {}{more} ({came} bytes came)", places.join(", "));
                return Err(deadline.error(&what).in_file(&self.name));
            }
            Some(Ended::Abandoned) | None => {
                return Err(self.error("address", "fetching was abandoned"));
            }
        };
        let stamp = parts.first().map(|(stamp, _)| stamp.clone());
        let Some(stamp) = expected.cloned().or(stamp) else {
            return Err(self.error("address", "no range was asked for"));
        };
        for ((actual, bytes), range) in parts.iter().zip(ranges) {
            if *actual != stamp {
                let message = "the object on the server changed while it was read";
                return Err(self.error("object", message).hint("try again"));
            }
            let wanted = range.end.min(actual.size).saturating_sub(range.start);
            if bytes.len() as u64 != wanted {
                return Err(self.explained(range, &Trouble::Short(bytes.len() as u64)));
            }
        }
        Ok((stamp, parts.into_iter().map(|(_, bytes)| bytes).collect()))
    }

    /// Fetches ranges at once, within a time.
    async fn fetched(self, ranges: Vec<Range<u64>>, time: Option<Duration>) -> Ended {
        let all = async {
            let mut tasks = JoinSet::new();
            for (number, range) in ranges.iter().cloned().enumerate() {
                let link = self.clone();
                tasks.spawn(async move { (number, link.part_patiently(range).await) });
            }
            let mut parts: Vec<Option<(Stamp, Bytes)>> = vec![None; ranges.len()];
            while let Some(done) = tasks.join_next().await {
                let Ok((number, answer)) = done else { return Ended::Abandoned };
                match answer {
                    Ok(part) => parts[number] = Some(part),
                    Err(trouble) => return Ended::Failed(ranges[number].clone(), trouble),
                }
            }
            parts.into_iter().collect::<Option<_>>().map_or(Ended::Abandoned, Ended::Done)
        };
        // Dropping the requests ends them.
        match time {
            // A fast server might still answer.
            Some(Duration::ZERO) => Ended::Late,
            Some(time) => tokio::time::timeout(time, all).await.unwrap_or(Ended::Late),
            None => all.await,
        }
    }

    /// Fetches a range, again if the answer is too short. The store repeats requests that fail.
    async fn part_patiently(&self, range: Range<u64>) -> Result<(Stamp, Bytes), Trouble> {
        let mut pause = self.patience.first_pause;
        for _ in 0..self.patience.retries {
            match self.part(range.clone()).await {
                Err(Trouble::Short(_)) => {}
                other => return other,
            }
            tokio::time::sleep(pause).await;
            pause *= 2;
        }
        self.part(range).await
    }

    async fn part(&self, range: Range<u64>) -> Result<(Stamp, Bytes), Trouble> {
        // Nobody closes the semaphore.
        let _permit = self.turns.acquire().await;
        REQUESTS.fetch_add(1, Relaxed);
        let options = GetOptions { range: Some(GetRange::Bounded(range)), ..GetOptions::default() };
        let response =
            self.store.get_opts(&self.location, options).await.map_err(Trouble::Store)?;
        let stamp = Stamp {
            size: response.meta.size,
            tag: response.meta.e_tag.clone(),
            modified: response.meta.last_modified.timestamp(),
        };
        let expected = response.range.end - response.range.start;
        let bytes = response.bytes().await.map_err(Trouble::Store)?;
        BYTES.fetch_add(bytes.len() as u64, Relaxed);
        if bytes.len() as u64 != expected {
            return Err(Trouble::Short(bytes.len() as u64));
        }
        Ok((stamp, bytes))
    }

    /// The bytes that came so far.
    #[cfg(test)]
    pub fn came(&self) -> u64 {
        self.came.load(Relaxed)
    }

    /// The object's name in messages.
    pub fn name(&self) -> &Path {
        &self.name
    }

    pub fn error(&self, place: impl Into<String>, message: impl Into<String>) -> Error {
        Error::input(&self.name, place, message)
    }

    /// Says in words what a server or the way to it did wrong.
    fn explained(&self, range: &Range<u64>, trouble: &Trouble) -> Error {
        use object_store::Error as E;
        let place = format!("bytes {} to {}", range.start, range.end);
        let (message, hint) = match trouble {
            Trouble::Store(E::NotFound { .. }) => {
                ("there is no such object (404)".into(), "check the address")
            }
            Trouble::Store(E::PermissionDenied { .. } | E::Unauthenticated { .. }) => (
                "the server refuses access (401 or 403)".into(),
                "credentials are taken from the environment, for example AWS_ACCESS_KEY_ID; for a \
                 public bucket of S3 set AWS_SKIP_SIGNATURE=true",
            ),
            Trouble::Store(error) => {
                if let Some(refused) = Refused::of(error) {
                    return self.error(place, refused.to_string()).hint(refused.hint());
                }
                let why = self.without_secrets(innermost(error));
                (
                    format!("the server cannot be read: {why}"),
                    "check the address and the network, then try again",
                )
            }
            Trouble::Short(received) => (
                format!(
                    "the server was asked for {} bytes and sent {received}",
                    range.end - range.start
                ),
                "check the server and the network, then try again",
            ),
        };
        self.error(place, message).hint(hint)
    }

    /// Removes the query of the address from a message, and shortens it.
    fn without_secrets(&self, message: String) -> String {
        let whole = address::whole(&self.name).unwrap_or_default();
        let query = whole.split_once('?').map(|(_, query)| query).filter(|query| !query.is_empty());
        let message = query.map_or(message.clone(), |query| message.replace(query, "…"));
        let line = message.split_whitespace().collect::<Vec<_>>().join(" ");
        line.chars().take(200).collect()
    }
}

/// The text of the error that caused the others.
fn innermost(error: &object_store::Error) -> String {
    let mut error: &dyn std::error::Error = error;
    while let Some(source) = error.source() {
        error = source;
    }
    error.to_string()
}

type Opened = (Arc<dyn ObjectStore>, object_store::path::Path);

/// Opens the store of an address. Credentials come from the environment.
fn open(
    scheme: &str,
    whole: &str,
    [bucket, key]: [&str; 2],
    patience: &Patience,
    connector: Connector,
) -> object_store::Result<Opened> {
    // There may be one already, that of a host application.
    rustls::crypto::ring::default_provider().install_default().ok();
    let retry = RetryConfig {
        backoff: BackoffConfig {
            init_backoff: patience.first_pause,
            max_backoff: Duration::from_secs(5),
            base: 2.0,
        },
        max_retries: patience.retries,
        retry_timeout: patience.answer * (patience.retries as u32 + 1),
    };
    let text_of = |time: Duration| format!("{} ms", time.as_millis());
    let times = [
        (ClientConfigKey::ConnectTimeout, text_of(patience.connect)),
        (ClientConfigKey::ReadTimeout, text_of(patience.read)),
        (ClientConfigKey::Timeout, text_of(patience.answer)),
    ];
    // The builders have no trait in common.
    macro_rules! patient {
        ($builder:expr, $key:expr) => {
            times.into_iter().fold(
                $builder.with_retry(retry).with_http_connector(connector),
                |builder, (key, value)| builder.with_config($key(key), value),
            )
        };
    }
    let store: Arc<dyn ObjectStore> = match scheme {
        "s3" => {
            let builder = AmazonS3Builder::from_env().with_bucket_name(bucket);
            Arc::new(patient!(builder, AmazonS3ConfigKey::Client).build()?)
        }
        "gs" => {
            let builder = GoogleCloudStorageBuilder::from_env().with_bucket_name(bucket);
            Arc::new(patient!(builder, GoogleConfigKey::Client).build()?)
        }
        "az" => {
            let builder = MicrosoftAzureBuilder::from_env().with_container_name(bucket);
            Arc::new(patient!(builder, AzureConfigKey::Client).build()?)
        }
        _ => {
            let allow = (scheme == "http").to_string();
            let builder =
                HttpBuilder::new().with_url(whole).with_config(ClientConfigKey::AllowHttp, allow);
            let store = patient!(builder, std::convert::identity).build()?;
            // The address is that of the object already, and keeps its query.
            return Ok((Arc::new(store), object_store::path::Path::default()));
        }
    };
    Ok((store, object_store::path::Path::parse(key)?))
}

/// Runs a task on the threads for requests and waits for it. `None` if it could not run. It may be
/// called on any thread, also on one of a host's own runtime.
fn wait<T: Send + 'static>(task: impl Future<Output = T> + Send + 'static) -> Option<T> {
    static RUNTIME: LazyLock<Option<Runtime>> = LazyLock::new(|| {
        let mut builder = tokio::runtime::Builder::new_multi_thread();
        let built = builder.worker_threads(2).thread_name("splatkit-fetch").enable_all().build();
        built.inspect_err(|error| tracing::warn!("no thread can fetch: {error}")).ok()
    });
    let (sender, receiver) = mpsc::sync_channel(1);
    RUNTIME.as_ref()?.spawn(async move { sender.send(task.await) });
    receiver.recv().ok()
}
