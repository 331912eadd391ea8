#!/usr/bin/env bash
# sandbox.sh FOLDER SCRATCH COMMAND...: run a command that may be out of its mind. It sees its own processes only, may
# write to FOLDER (mounted on /mnt, the working folder is /mnt/tree) and to SCRATCH (mounted on /tmp), and everything that
# it started ends with it. Needs root or user namespaces.
set -eu
if [ "$1" != --inside ]; then
    user=; [ "$(id -u)" = 0 ] || user=--map-root-user
    # shellcheck disable=SC2086
    exec unshare $user --mount --pid --fork --mount-proc --kill-child "$0" --inside "$@"
fi
folder=$2; scratch=$3; shift 3
mount --make-rprivate /
mount --bind "$folder" /mnt
mkdir -p "$scratch"
mount --bind "$scratch" /tmp
while read -r _ point type _; do
    case "$point:$type" in
    /mnt:* | /tmp:*) ;;
    *:ext[234] | *:xfs | *:btrfs | *:overlay | *:zfs | *:f2fs | *:nfs*) mount -o remount,bind,ro "$point" ;;
    esac
done < /proc/self/mounts
cd /mnt/tree
ulimit -f 4194304
ulimit -c 0
exec "$@"
