# Installs what ./tools/demo and ./tools/test need besides the Rust toolchain: a linker, and a
# Vulkan driver for the tests of the GPU engine. Sourced, not run.

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

# Installs Debian packages, or fails with a list of what to install.
install_packages() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then as_root=(sudo -n); fi
    if ! command -v apt-get >/dev/null ||
        { [ "$(id -u)" -ne 0 ] && ! sudo -n true 2>/dev/null; }; then
        fail "please install: $* (Debian and Ubuntu: apt-get install $*)"
    fi
    say "Installing $*"
    local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get)
    local get=("${apt[@]}" install -y --no-install-recommends "$@")
    # A fresh machine has no package lists; an old one has outdated lists.
    "${get[@]}" </dev/null || { "${apt[@]}" update </dev/null && "${get[@]}" </dev/null; } ||
        fail "apt-get could not install $*"
}

# Whether the Vulkan loader and a driver are installed. macOS has Metal, Windows has Direct3D.
has_vulkan() {
    [ "$(uname -s)" = Linux ] || return 0
    local libraries
    libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null || true)
    [[ $libraries == *libvulkan.so.1* ]] || return 1
    [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] || return 0
    local file home="${XDG_DATA_HOME:-$HOME/.local/share}"
    for file in {/usr/share,/usr/local/share,/etc,"$home"}/vulkan/icd.d/*.json; do
        [ -e "$file" ] && return 0
    done
    return 1
}

command -v cargo >/dev/null || PATH="$PATH:$HOME/.cargo/bin"
command -v cargo >/dev/null || fail "cargo is missing: install Rust from https://rustup.rs"
# Elsewhere, the compiler of the system links, under another name on Windows.
[ "$(uname -s)" != Linux ] || command -v cc >/dev/null || install_packages gcc libc6-dev

# Installs a Vulkan driver if there is none.
need_vulkan() {
    has_vulkan || install_packages mesa-vulkan-drivers libvulkan1
    # Mesa reads this variable and complains if it is unset.
    export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}"
}
