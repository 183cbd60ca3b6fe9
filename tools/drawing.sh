# What ./tools/pictures and ./tools/gallery share: the command, and the choice of pictures by their
# names. Sourced, not run.
# shellcheck disable=SC2034

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
. "$root/tools/setup.sh"
pictures="$root/docs/pictures"
wanted=()

# build PACKAGE…: builds packages, and sets `bin` to the folder of their programs.
build() {
    local packages=() name
    for name in "$@"; do packages+=(-p "$name"); done
    say "Building"
    cargo build --release --locked --manifest-path "$root/Cargo.toml" "${packages[@]}"
    bin="${CARGO_TARGET_DIR:-$root/target}/release"
}

# is_wanted NAME: whether the picture is to be drawn. All are if `wanted` is empty.
is_wanted() {
    local prefix
    for prefix in "${wanted[@]:-}"; do
        [[ $1 != "$prefix"* ]] || return 0
    done
    return 1
}
