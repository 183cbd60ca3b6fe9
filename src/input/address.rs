//! Addresses in the place of paths: `https://…`, `http://…`, `s3://…`, `gs://…`, `az://…`.

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// The beginnings of addresses.
pub(super) const SCHEMES: [&str; 5] = ["https://", "http://", "s3://", "gs://", "az://"];

/// The whole addresses of names that leave a part out.
static WHOLE: Mutex<BTreeMap<PathBuf, String>> = Mutex::new(BTreeMap::new());

/// Returns whether a path is the address of a remote object: `https://…`, `http://…`, `s3://…`,
/// `gs://…` or `az://…`.
pub fn is_remote(path: impl AsRef<Path>) -> bool {
    let text = path.as_ref().as_os_str().as_encoded_bytes();
    SCHEMES.iter().any(|scheme| text.starts_with(scheme.as_bytes()))
}

/// Returns the path by which an address is opened and named in messages. It leaves out what may be
/// secret: the user's name and password, and the query, which may be a signature. This process
/// remembers them. Addresses that differ only in these parts get numbers. The path of an address
/// with a query stands for it from then on, with or without the query. Other paths are returned
/// unchanged.
///
/// ```
/// use splatkit::input::address;
///
/// let path = address("https://example.org/scan.splk?signature=secret");
/// assert_eq!(path.to_str(), Some("https://example.org/scan.splk"));
/// assert_eq!(address("a?b.ply").to_str(), Some("a?b.ply"));
/// ```
pub fn address(text: impl AsRef<OsStr>) -> PathBuf {
    let path = PathBuf::from(text.as_ref());
    let Some(text) = path.to_str().filter(|_| is_remote(&path)) else { return path };
    let mut whole = WHOLE.lock().unwrap_or_else(PoisonError::into_inner);
    if whole.contains_key(&path) {
        return path;
    }
    let (scheme, rest) = text.split_once("://").unwrap_or_default();
    // Keys of buckets may contain any character.
    let open = if scheme.starts_with("http") { rest.find(['?', '#']) } else { None };
    let open = &rest[..open.unwrap_or(rest.len())];
    let (host, tail) = open.split_at(open.find('/').unwrap_or(open.len()));
    let host = host.rsplit_once('@').map_or(host, |(_, host)| host);
    let mut name = PathBuf::from(format!("{scheme}://{host}{tail}"));
    // Another query may be another object.
    for number in 2.. {
        if whole.get(&name).is_none_or(|known| known == text) {
            break;
        }
        name = format!("{scheme}://{number}@{host}{tail}").into();
    }
    whole.insert(name.clone(), text.to_owned());
    name
}

/// Returns the path of an object below another, of a path or of a name from [`address`]: what the
/// other's name leaves out, the new one leaves out too.
#[cfg(feature = "zarr")]
pub(crate) fn below(name: &Path, key: &str) -> PathBuf {
    let known = WHOLE.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned();
    let query = known.as_deref().and_then(|whole| whole.split_once('?'));
    match query {
        Some((start, query)) => address(format!("{}/{key}?{query}", start.trim_end_matches('/'))),
        None => {
            let text = name.to_string_lossy();
            PathBuf::from(format!("{}/{key}", text.trim_end_matches('/')))
        }
    }
}

/// Returns the whole address of a name from [`address`]. The error is a message.
#[cfg_attr(not(feature = "remote"), expect(dead_code, reason = "nothing is opened"))]
pub(super) fn whole(name: &Path) -> Result<String, String> {
    let whole = WHOLE.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned();
    match whole {
        Some(whole) => Ok(whole),
        None => name.to_str().map(str::to_owned).ok_or_else(|| "is not UTF-8 text".into()),
    }
}

/// Returns whether a name from [`address`] leaves nothing out, so that other processes may use it.
pub(crate) fn is_whole(name: &Path) -> bool {
    let whole = WHOLE.lock().unwrap_or_else(PoisonError::into_inner);
    whole.get(name).is_none_or(|whole| Path::new(whole) == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_told_from_paths() {
        for text in ["https://a/b", "http://a", "s3://b/k", "gs://b/k", "az://c/k"] {
            assert!(is_remote(text), "{text}");
        }
        for text in ["a.ply", "https:/a", "file:///a", "dir/https://a", "", "C:\\a"] {
            assert!(!is_remote(text), "{text}");
            assert_eq!(address(text), Path::new(text));
        }
    }

    #[test]
    fn names_leave_secrets_out() {
        for (text, name) in [
            ("https://h/a.splk?x=y/z.ply", "https://h/a.splk"),
            ("http://me:word@h:80/a@b.splk#c", "http://h:80/a@b.splk"),
            ("https://h", "https://h"),
            ("s3://bucket/what?.splk", "s3://bucket/what?.splk"),
        ] {
            let path = address(text);
            assert_eq!(path.to_str(), Some(name));
            assert_eq!(address(&path), path);
            assert_eq!(is_whole(&path), text == name);
            #[cfg(feature = "remote")]
            assert_eq!(whole(&path).as_deref(), Ok(text));
        }
    }

    #[test]
    fn other_queries_are_other_objects() {
        let texts =
            ["https://q/get.splk?id=1", "https://q/get.splk?id=2", "https://q/get.splk?id=3"];
        let names = texts.map(address);
        let expected = ["https://q/get.splk", "https://2@q/get.splk", "https://3@q/get.splk"];
        assert_eq!(names.each_ref().map(|name| name.to_str()), expected.map(Some));
        for (text, name) in texts.into_iter().zip(&names) {
            assert_eq!((&address(text), &address(name)), (name, name));
            #[cfg(feature = "remote")]
            assert_eq!(whole(name).as_deref(), Ok(text));
        }
    }
}
