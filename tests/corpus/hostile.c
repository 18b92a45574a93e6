/* FMUs that mean harm, for the tests of the sandbox: fmu.c, doing one of these things in its first step.
 *
 * EIXO_CANARY names a folder that is none of the FMU's business, EIXO_PORT a port on which the test listens. What could be
 * read prints LEAK. Compile: cc -shared -fPIC -DACT=<name> -o corpus.so hostile.c -lm -lpthread */
static void hostile(void);
#define HOOK() hostile()
#include "fmu.c"

#include <arpa/inet.h>
#include <dirent.h>
#include <fcntl.h>
#include <mqueue.h>
#include <sys/inotify.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/ioctl.h>
#include <termios.h>

enum {
    WRITE, APPEND, DELETE, RENAME, FOLDER, SYMLINK, HARDLINK, MODE, CUT, TIMES, OWNER, READ, READ_PASSWORDS, READ_PARENT,
    LIST_HOME, TCP, UDP, LOCAL_SOCKET, FORK, BOMB, DETACH, SHELL, EXECUTE, KILL_PARENT, KILL_ALL, TRACE, FILL, PRINT, LINK_IN_TMP,
    LINK_FOLDER, THREADS_MANY, MEMORY, HANG, SEGMENT, ANONYMOUS_FILE, MOUNT, NAMESPACE, CLOSE_ALL, WRITE_ALL, OUTLIVE, DEVICE,
    PRIORITY_LIMITS, OTHERS_MEMORY, TCP_OVER_6, PAIRED_DATAGRAM, NETLINK, RING, SIGNAL_BY_FILE, SIGNAL_BY_DESCRIPTOR, PARENT_MEMORY,
    PARENT_PRIORITY, PARENT_LIMITS, WATCH_HOME, OTHERS_SEGMENTS, QUEUE, KEYRING, ATTRIBUTE, NODE, NEW_MOUNT,
    HANDLE, HOST_NAME, PARENT_AFFINITY, PARENT_SCHEDULING, GROUP, QUEUED_SIGNAL, STOP_PARENT, TERMINAL, SHARED_MEMORY, SEMAPHORE,
    PARENT_FILES, PAGE_SCRIBBLED, PAGE_CUT, EMPTY_FILES, DEEP_FOLDERS, CLOSED_FOLDER, FILL_DEEP, FILL_BY_MAPPING
};

static char path[4096];

static const char *canary(const char *name) {
    snprintf(path, sizeof path, "%s/%s", getenv("EIXO_CANARY"), name);
    return path;
}

static void put(const char *name) {
    FILE *file = fopen(name, "a");
    if (file) fputs("harm", file), fclose(file);
}

static void leak(const char *name) {
    char text[16];
    FILE *file = fopen(name, "r");
    if (file && fread(text, 1, sizeof text, file) > 0) puts("LEAK");
}

static void send_to(int type) {
    struct sockaddr_in to = {0};
    int fd = socket(AF_INET, type, 0);
    to.sin_family = AF_INET;
    to.sin_port = htons((uint16_t)atoi(getenv("EIXO_PORT")));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd >= 0 && connect(fd, (struct sockaddr *)&to, sizeof to) == 0) send(fd, "harm", 4, 0);
}

static void *spin(void *unused) {
    for (;;) sleep(1);
    return unused;
}

static void hostile(void) {
    static int done;
    char other[4096], *arguments[] = {"touch", NULL, NULL};
    int n;
    if (done++) return;
    switch (ACT) {
    case WRITE: put(canary("new")); break;
    case APPEND: put(canary("file")); break;
    case DELETE: unlink(canary("file")); break;
    case RENAME: snprintf(other, sizeof other, "%s", canary("file")); rename(other, canary("moved")); break;
    case FOLDER: mkdir(canary("folder"), 0777); break;
    case SYMLINK: symlink("/etc/passwd", canary("link")); break;
    case HARDLINK: link(canary("file"), "mine"); put("mine"); break;
    case MODE: chmod(canary("file"), 0777); syscall(SYS_fchmodat, AT_FDCWD, canary("file"), 0777); break;
    case CUT: truncate(canary("file"), 0); open(canary("file"), O_WRONLY | O_TRUNC); break;
    case TIMES: { struct timeval t[2] = {{1, 0}, {1, 0}}; utimes(canary("file"), t); break; }
    case OWNER: chown(canary("file"), 12345, 12345); break;
    case READ: leak(canary("file")); break;
    case READ_PASSWORDS: leak("/etc/passwd"); leak("/etc/shadow"); leak("/etc/hostname"); break;
    case READ_PARENT: snprintf(other, sizeof other, "/proc/%d/environ", getppid()); leak(other); break;
    case LIST_HOME: if (opendir(getenv("HOME"))) puts("LEAK"); break;
    case TCP: send_to(SOCK_STREAM); break;
    case UDP: send_to(SOCK_DGRAM); break;
    case LOCAL_SOCKET: {
        struct sockaddr_un to = {.sun_family = AF_UNIX};
        int fd = socket(AF_UNIX, SOCK_STREAM, 0);
        snprintf(to.sun_path, sizeof to.sun_path, "%s", canary("s"));
        if (fd >= 0) connect(fd, (struct sockaddr *)&to, sizeof to);
        break;
    }
    case FORK: if (fork() == 0) for (;;) sleep(1); break;
    case BOMB: for (n = 0; n < 100; n++) fork(); break;
    case DETACH: if (fork() == 0) { setsid(); if (fork() == 0) for (;;) sleep(1); _exit(0); } break;
    case SHELL: snprintf(other, sizeof other, "touch %s", canary("new")); system(other); break;
    case EXECUTE: arguments[1] = (char *)canary("new"); execv("/usr/bin/touch", arguments); break;
    case KILL_PARENT: kill(getppid(), SIGKILL); syscall(SYS_tkill, getppid(), SIGKILL); break;
    case KILL_ALL: kill(getppid(), SIGTERM); kill(-getppid(), SIGKILL); break;
    case TRACE: ptrace(PTRACE_ATTACH, getppid(), 0, 0); break;
    case FILL: {
        static char block[1 << 20];
        for (n = 0; n < 4000; n++) {
            snprintf(other, sizeof other, "fill%d", n);
            FILE *file = fopen(other, "w");
            if (file) fwrite(block, 1, sizeof block, file), fclose(file);
        }
        break;
    }
    case PRINT: for (;;) puts("nothing to say");
    case LINK_IN_TMP:
        snprintf(other, sizeof other, "%s/link", getenv("TMPDIR"));
        symlink(canary("file"), other);
        put(other);
        break;
    case LINK_FOLDER:
        snprintf(other, sizeof other, "%s/folder", getenv("TMPDIR"));
        symlink(getenv("EIXO_CANARY"), other);
        snprintf(path, sizeof path, "%s/new", other);
        put(path);
        break;
    case THREADS_MANY:
        for (n = 0; n < 20000; n++) {
            pthread_t thread;
            if (pthread_create(&thread, NULL, spin, NULL)) break;
        }
        break;
    case MEMORY: for (;;) if (!memset(malloc(64 << 20), 1, 64 << 20)) break;
    case HANG: for (;;) sleep(1);
    case SEGMENT: { int id = shmget(4711, 4096, IPC_CREAT | 0666); if (id >= 0) puts("LEAK"); break; }
    case ANONYMOUS_FILE: { int fd = (int)syscall(SYS_memfd_create, "m", 0); if (fd >= 0) puts("LEAK"); break; }
    case MOUNT: mount("none", getenv("EIXO_CANARY"), "tmpfs", 0, ""); break;
    case NAMESPACE: if (unshare(CLONE_NEWUSER) == 0) puts("LEAK"); break;
    case CLOSE_ALL: for (n = 0; n < 1024; n++) close(n); break;
    case WRITE_ALL: for (n = 3; n < 1024; n++) if (write(n, "harm", 4) < 0) continue; break;
    case OUTLIVE: prctl(PR_SET_PDEATHSIG, 0); for (;;) sleep(1);
    case DEVICE: { int fd = open("/dev/tty", O_RDWR); if (fd >= 0) puts("LEAK"); leak("/dev/mem"); break; }
    case PRIORITY_LIMITS: {
        struct { unsigned long now, most; } limit = {~0UL, ~0UL};
        if (syscall(SYS_prlimit64, 0, 9, &limit, NULL) == 0) puts("LEAK");
        break;
    }
    case OTHERS_MEMORY: snprintf(other, sizeof other, "/proc/%d/mem", getppid()); leak(other); leak("/proc/1/environ"); break;
    case TCP_OVER_6: {
        /* The test's address, written as one of IPv6. */
        struct sockaddr_in6 to = {.sin6_family = AF_INET6, .sin6_port = htons((uint16_t)atoi(getenv("EIXO_PORT")))};
        int fd = socket(AF_INET6, SOCK_STREAM, 0);
        inet_pton(AF_INET6, "::ffff:127.0.0.1", &to.sin6_addr);
        if (fd >= 0) connect(fd, (struct sockaddr *)&to, sizeof to);
        break;
    }
    case PAIRED_DATAGRAM: {
        /* A pair is made without socket(), and one end of it sends to whom it likes. */
        static const int kinds[] = {SOCK_DGRAM, SOCK_RAW};
        struct sockaddr_un to = {.sun_family = AF_UNIX};
        int pair[2];
        snprintf(to.sun_path, sizeof to.sun_path, "%s", canary("d"));
        for (n = 0; n < 2; n++)
            if (socketpair(AF_UNIX, kinds[n], 0, pair) == 0) sendto(pair[0], "harm", 4, 0, (struct sockaddr *)&to, sizeof to);
        break;
    }
    case NETLINK: if (socket(AF_NETLINK, SOCK_RAW, 0) >= 0) puts("LEAK"); break;
    case RING: { char room[256] = {0}; if (syscall(SYS_io_uring_setup, 4, room) >= 0) puts("LEAK"); break; }
    case SIGNAL_BY_FILE: {
        /* The kernel sends a pipe's signal to its owner, whoever that is said to be. */
        struct { int type, pid; } owner = {1, getppid()};
        int ends[2];
        if (pipe(ends)) break;
        fcntl(ends[0], F_SETOWN, getppid());
        fcntl(ends[0], F_SETOWN_EX, &owner);
        fcntl(ends[0], F_SETSIG, SIGKILL);
        fcntl(ends[0], F_SETFL, O_ASYNC);
        if (fcntl(ends[0], F_GETOWN) == getppid()) puts("LEAK");
        if (write(ends[1], "harm", 4) < 0) puts("nothing sent");
        break;
    }
    case SIGNAL_BY_DESCRIPTOR: {
        int fd = (int)syscall(434 /* pidfd_open */, getppid(), 0);
        if (fd >= 0) puts("LEAK"), syscall(424 /* pidfd_send_signal */, fd, SIGKILL, NULL, 0);
        break;
    }
    case PARENT_MEMORY: {
        struct iovec mine = {other, 16}, theirs = {(void *)hostile, 16};
        if (process_vm_readv(getppid(), &mine, 1, &theirs, 1, 0) > 0) puts("LEAK");
        if (process_vm_writev(getppid(), &mine, 1, &theirs, 1, 0) > 0) puts("LEAK");
        break;
    }
    case PARENT_PRIORITY:
        if (setpriority(PRIO_PROCESS, getppid(), 19) == 0 || setpriority(PRIO_USER, 0, 19) == 0) puts("LEAK");
        break;
    case PARENT_LIMITS: {
        struct { unsigned long now, most; } limit = {3, 3};
        if (syscall(SYS_prlimit64, getppid(), RLIMIT_NOFILE, &limit, NULL) == 0) puts("LEAK");
        break;
    }
    case WATCH_HOME: if (inotify_add_watch(inotify_init(), getenv("HOME"), IN_ALL_EVENTS) >= 0) puts("LEAK"); break;
    case OTHERS_SEGMENTS: { struct shmid_ds room; if (shmctl(0, 14 /* SHM_INFO */, &room) >= 0) puts("LEAK"); break; }
    case QUEUE: if (mq_open("/eixo", O_CREAT | O_RDWR, 0600, NULL) >= 0) puts("LEAK"), mq_unlink("/eixo"); break;
    case KEYRING: if (syscall(SYS_add_key, "user", "eixo", "harm", 4, -4 /* the user's */) >= 0) puts("LEAK"); break;
    case ATTRIBUTE: if (setxattr(canary("file"), "user.harm", "harm", 4, 0) == 0) puts("LEAK"); break;
    case NODE: mknod(canary("node"), S_IFIFO | 0666, 0); break;
    case NEW_MOUNT: if (syscall(430 /* fsopen */, "tmpfs", 0) >= 0) puts("LEAK"); break;
    case HANDLE: {
        struct { struct file_handle head; char rest[128]; } handle = {.head.handle_bytes = 128};
        int mount, fd;
        if (name_to_handle_at(AT_FDCWD, canary("file"), &handle.head, &mount, 0)) break;
        fd = open_by_handle_at(AT_FDCWD, &handle.head, O_RDWR);
        if (fd >= 0) puts("LEAK");
        break;
    }
    case PARENT_AFFINITY: {
        cpu_set_t one;
        CPU_ZERO(&one);
        CPU_SET(0, &one);
        if (sched_setaffinity(getppid(), sizeof one, &one) == 0 || sched_setaffinity(1, sizeof one, &one) == 0) puts("LEAK");
        /* One's own threads are one's own affair. */
        sched_getaffinity(0, sizeof one, &one);
        if (sched_setaffinity(0, sizeof one, &one) || sched_setaffinity(getpid(), sizeof one, &one)) puts("LEAK");
        break;
    }
    case PARENT_SCHEDULING: {
        struct sched_param none = {0};
        struct { unsigned size, policy; unsigned long flags; int nice; unsigned rest[7]; } idle = {48, 5 /* SCHED_IDLE */};
        if (sched_setscheduler(getppid(), 5, &none) == 0 || sched_setparam(getppid(), &none) == 0) puts("LEAK");
        if (syscall(SYS_sched_setattr, getppid(), &idle, 0) == 0) puts("LEAK");
        if (syscall(SYS_ioprio_set, 1, getppid(), 3 << 13 /* idle */) == 0) puts("LEAK");
        break;
    }
    case GROUP:
        if (setpgid(getppid(), 0) == 0 || setpgid(0, getpgid(getppid())) == 0 || getsid(0) == getsid(getppid())) puts("LEAK");
        kill(0, SIGTERM);
        break;
    case QUEUED_SIGNAL: {
        siginfo_t info = {.si_signo = SIGKILL, .si_code = SI_QUEUE};
        if (syscall(SYS_rt_sigqueueinfo, getppid(), SIGKILL, &info) == 0) puts("LEAK");
        if (syscall(SYS_rt_tgsigqueueinfo, getppid(), getppid(), SIGKILL, &info) == 0) puts("LEAK");
        if (syscall(SYS_tgkill, getppid(), getppid(), SIGKILL) == 0) puts("LEAK");
        break;
    }
    case STOP_PARENT: if (kill(getppid(), SIGSTOP) == 0) puts("LEAK"); break;
    case TERMINAL: {
        struct termios modes;
        const char *names[] = {"/dev/tty", "/dev/ptmx", "/dev/pts/0", "/dev/pts/1", "/dev/console", "/dev/tty0"};
        for (n = 0; n < 3; n++)
            if (tcgetattr(n, &modes) == 0 || ioctl(n, TIOCSTI, "x") == 0 || ioctl(n, TIOCSCTTY, 1) == 0) puts("LEAK");
        for (n = 0; n < 6; n++)
            if (open(names[n], O_RDWR | O_NOCTTY) >= 0) puts("LEAK");
        break;
    }
    case SHARED_MEMORY:
        if (shm_open("/eixo-hostile", O_CREAT | O_RDWR, 0600) >= 0) puts("LEAK"), shm_unlink("/eixo-hostile");
        break;
    case SEMAPHORE:
        if (sem_open("/eixo-hostile", O_CREAT, 0600, 1) != SEM_FAILED) puts("LEAK"), sem_unlink("/eixo-hostile");
        break;
    case PARENT_FILES: {
        const char *names[] = {"fd/0", "fd/1", "fd/2", "oom_score_adj", "comm", "coredump_filter", "clear_refs", "cwd/Cargo.toml"};
        for (n = 0; n < 8; n++) {
            snprintf(other, sizeof other, "/proc/%d/%s", getppid(), names[n]);
            if (open(other, O_WRONLY) >= 0 || open(other, O_RDONLY) >= 0) puts("LEAK");
        }
        break;
    }
    case PAGE_SCRIBBLED:
    case PAGE_CUT: {
        /* The memory that the host shares: each of the mappings that can be written and are seen by others. */
        FILE *maps = fopen("/proc/self/maps", "r");
        char line[4096], *file;
        unsigned long from, to;
        int found = 0;
        while (maps && fgets(line, sizeof line, maps)) {
            if (sscanf(line, "%lx-%lx rw-s", &from, &to) != 2 || !strstr(line, " rw-s ") || !(file = strchr(line, '/'))) continue;
            found = 1;
            file[strcspn(file, "\n")] = 0;
            if (ACT == PAGE_SCRIBBLED) memset((void *)from, 0xA5, to - from);
            else if (truncate(file, 0) == 0 || unlink(file) == 0 || open(file, O_WRONLY | O_TRUNC) >= 0) puts("LEAK");
        }
        if (!found) puts("LEAK");
        break;
    }
    case EMPTY_FILES:
        for (n = 0; n < 200000; n++) {
            snprintf(other, sizeof other, "empty%d", n);
            close(open(other, O_CREAT | O_WRONLY, 0600));
        }
        break;
    case DEEP_FOLDERS: for (n = 0; n < 5000; n++) if (mkdir("d", 0700) || chdir("d")) break; break;
    case CLOSED_FOLDER:
        mkdir("closed", 0300);
        mkdir("closed/within", 0700);
        put("closed/within/file");
        mkdir("empty", 0);
        break;
    case FILL_DEEP:
    case FILL_BY_MAPPING: {
        static char block[1 << 20];
        memset(block, 1, sizeof block);
        if (ACT == FILL_DEEP) for (n = 0; n < 3000; n++) if (mkdir("d", 0700) || chdir("d")) break;
        for (n = 0; n < 4000; n++) {
            snprintf(other, sizeof other, "fill%d", n);
            int fd = open(other, O_CREAT | O_RDWR, 0600);
            if (fd < 0) break;
            if (ACT == FILL_DEEP) {
                if (write(fd, block, sizeof block) < 0) break;
            } else if (ftruncate(fd, sizeof block) == 0) {
                char *memory = mmap(NULL, sizeof block, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
                if (memory != MAP_FAILED) memcpy(memory, block, sizeof block), munmap(memory, sizeof block);
            }
            close(fd);
        }
        break;
    }
    case HOST_NAME: if (gethostname(other, sizeof other) == 0 && sethostname(other, strlen(other)) == 0) puts("LEAK"); break;
    }
}
