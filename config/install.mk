# Installation below PREFIX, and the Debian package that is made of it. docs/operating.md says what goes where.
.PHONY: install manual uninstall deb deps-package test-deb
PREFIX ?= /usr/local
DESTDIR ?=
# where systemd and administrators look, whatever the prefix of a system-wide installation
SYSCONFDIR ?= $(if $(filter /usr /usr/local,$(PREFIX)),/etc,$(PREFIX)/etc)
UNITDIR ?= $(PREFIX)/lib/systemd/system
SYSUSERSDIR ?= $(PREFIX)/lib/sysusers.d
SHAREDIR := $(PREFIX)/share/selvedge
DOCDIR := $(PREFIX)/share/doc/selvedge
MANDIR := $(PREFIX)/share/man
INSTALL ?= install

# manual pages and completion of shells, of the tables and texts behind --help
MANUAL := $(BUILD)/manual
BASHDIR := $(PREFIX)/share/bash-completion/completions
ZSHDIR := $(PREFIX)/share/zsh/$(if $(filter /usr,$(PREFIX)),vendor-completions,site-functions)
FISHDIR := $(PREFIX)/share/fish/vendor_completions.d
MAN_NAMES := selvedge.1 selvedged.8 selvedge-worker.1 selvedge-phantom.1 selvedge-camera.1 selvedge-mpi.1 selvedge.conf.5

DASHBOARD_FOLDERS := $(notdir $(patsubst %/,%,$(wildcard clients/dashboard/*/)))

##@ Installation
# configuration: kept where there is one; the default is beside the dashboard
install: all manual ## install below PREFIX (/usr/local) of DESTDIR: programs, dashboard, documents, unit, configuration
	$(INSTALL) -d $(addprefix "$(DESTDIR)",$(PREFIX)/bin $(addprefix $(SHAREDIR)/dashboard/,$(DASHBOARD_FOLDERS)) $(DOCDIR)/docs/images/gallery $(DOCDIR)/examples)
	$(INSTALL) $(PROGRAMS) "$(DESTDIR)$(PREFIX)/bin"
	$(if $(PLUGINS),$(INSTALL) -d "$(DESTDIR)$(PREFIX)/lib/selvedge" && $(INSTALL) -m 644 $(PLUGINS) "$(DESTDIR)$(PREFIX)/lib/selvedge")
	$(INSTALL) -m 644 $(filter-out %.md,$(wildcard clients/dashboard/*.*)) "$(DESTDIR)$(SHAREDIR)/dashboard"
	for folder in $(DASHBOARD_FOLDERS); do $(INSTALL) -m 644 clients/dashboard/$$folder/* "$(DESTDIR)$(SHAREDIR)/dashboard/$$folder" || exit 1; done
	$(INSTALL) -m 644 config/openapi.json config/result.schema.json config/selvedge.conf docs/glossary.md "$(DESTDIR)$(SHAREDIR)"
	$(INSTALL) -m 644 README.md CHANGELOG.md SECURITY.md CITATION.cff LICENSE "$(DESTDIR)$(DOCDIR)"
	$(INSTALL) -m 644 docs/*.md "$(DESTDIR)$(DOCDIR)/docs"
	$(INSTALL) -m 644 docs/images/*.* "$(DESTDIR)$(DOCDIR)/docs/images"
	$(INSTALL) -m 644 docs/images/gallery/* "$(DESTDIR)$(DOCDIR)/docs/images/gallery"
	$(INSTALL) -m 644 config/examples/* config/nginx.conf "$(DESTDIR)$(DOCDIR)/examples"
	$(INSTALL) -d "$(DESTDIR)$(UNITDIR)" "$(DESTDIR)$(SYSUSERSDIR)" "$(DESTDIR)$(SYSCONFDIR)/selvedge"
	$(INSTALL) -d -m 700 "$(DESTDIR)$(SYSCONFDIR)/selvedge/secrets"
	sed -e 's|/usr/bin/|$(PREFIX)/bin/|g' -e 's|/usr/share/doc/|$(PREFIX)/share/doc/|g' \
		-e 's|/etc/selvedge|$(SYSCONFDIR)/selvedge|g' config/selvedge.service > $(BUILD)/selvedge.service
	$(INSTALL) -m 644 $(BUILD)/selvedge.service "$(DESTDIR)$(UNITDIR)/selvedge.service"
	$(INSTALL) -m 644 config/selvedge.sysusers "$(DESTDIR)$(SYSUSERSDIR)/selvedge.conf"
	[ -e "$(DESTDIR)$(SYSCONFDIR)/selvedge/selvedge.conf" ] || \
		$(INSTALL) -m 644 config/selvedge.conf "$(DESTDIR)$(SYSCONFDIR)/selvedge/selvedge.conf"
	$(INSTALL) -d $(addprefix "$(DESTDIR)$(MANDIR)/man",1 5 8) "$(DESTDIR)$(BASHDIR)" "$(DESTDIR)$(ZSHDIR)" "$(DESTDIR)$(FISHDIR)"
	for page in $(MANUAL)/man/*; do $(INSTALL) -m 644 "$$page" "$(DESTDIR)$(MANDIR)/man$${page##*.}" || exit 1; done
	$(INSTALL) -m 644 $(MANUAL)/bash/* "$(DESTDIR)$(BASHDIR)"
	$(INSTALL) -m 644 $(MANUAL)/zsh/_selvedge "$(DESTDIR)$(ZSHDIR)"
	$(INSTALL) -m 644 $(MANUAL)/fish/* "$(DESTDIR)$(FISHDIR)"

# data and configuration are the administrator's
uninstall:         ## remove what install has put there, but neither configuration nor data
	rm -f $(patsubst %,"$(DESTDIR)$(PREFIX)/bin/%",$(notdir $(PROGRAMS)))
	rm -rf "$(DESTDIR)$(SHAREDIR)" "$(DESTDIR)$(DOCDIR)" "$(DESTDIR)$(PREFIX)/lib/selvedge"
	rm -f "$(DESTDIR)$(UNITDIR)/selvedge.service" "$(DESTDIR)$(SYSUSERSDIR)/selvedge.conf"
	rm -f $(foreach p,$(MAN_NAMES),"$(DESTDIR)$(MANDIR)/man$(patsubst .%,%,$(suffix $(p)))/$(p)") "$(DESTDIR)$(ZSHDIR)/_selvedge"
	rm -f $(foreach p,$(notdir $(PROGRAMS)),"$(DESTDIR)$(BASHDIR)/$p" "$(DESTDIR)$(FISHDIR)/$p.fish")
	@echo "kept: $(DESTDIR)$(SYSCONFDIR)/selvedge, the data and the user 'selvedge'"

# made anew each time: the texts of all programs are part of it
manual: $(PRINT_COMMANDS) $(PROGRAMS) ## manual pages and completion of shells in build/manual
	@rm -rf $(MANUAL)
	@/usr/bin/python3 config/generate_manual.py $(PRINT_COMMANDS) $(BUILD)/bin $(MANUAL)

# ---- the Debian package, built from the files of the tree in a copy of it
VERSION := $(shell sed -n 's/^\#define SELVEDGE_VERSION "\(.*\)"/\1/p' base/version.h)
# higher than that of the package before; a release has VERSION itself
DEB_VERSION ?= $(VERSION)
DEB_SOURCE := build/deb/selvedge
DEB_DATE := $(shell git log -1 --format=%cD 2>/dev/null || date -R)

deps-package:
	@./config/install-dependencies package

# WITHOUT_DEPS=1: packages are not installed here, for machines whose administrator does that
deb: $(if $(WITHOUT_DEPS),,deps-package) ## build the Debian package build/deb/selvedge_VERSION_ARCH.deb, and check it by lintian
	@mkdir -p $(DEB_SOURCE)
	@find $(DEB_SOURCE) -mindepth 1 -maxdepth 1 ! -name build -exec rm -rf {} +
	@git ls-files -z --cached --others --exclude-standard | tar --create --null --files-from=- --ignore-failed-read | \
		tar --extract --directory=$(DEB_SOURCE)
	@cp -r config/debian $(DEB_SOURCE)/debian
	@mkdir -p $(DEB_SOURCE)/debian/source && echo "3.0 (native)" > $(DEB_SOURCE)/debian/source/format
	@printf 'selvedge (%s) unstable; urgency=medium\n\n  * /usr/share/doc/selvedge/CHANGELOG.md lists the changes.\n\n -- %s  %s\n' \
		"$(DEB_VERSION)" "$$(sed -n 's/^Maintainer: //p' config/debian/control)" "$(DEB_DATE)" > $(DEB_SOURCE)/debian/changelog
	@cd $(DEB_SOURCE) && dpkg-buildpackage --build=binary --no-sign --no-pre-clean
	@cd build/deb && lintian --fail-on error,warning --display-info selvedge_$(DEB_VERSION)_*.changes
	@ls -l build/deb/selvedge_$(DEB_VERSION)_*.deb

# minutes: a chroot is made and packages are downloaded
test-deb: deb      ## the Debian package in a fresh Debian 12: install, run a job, upgrade, remove, purge (as root; some minutes)
	@/usr/bin/python3 tests/package/deb_lifecycle.py
