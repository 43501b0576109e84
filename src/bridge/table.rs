//! Handles: numbers that stand for objects, with generations.
//!
//! Any thread. A slot's object sits in an atomic box: taking it out is having it to oneself, for one exchange without a
//! lock. Sound calls try once ([`Table::try_with`]); control calls come again until it is back ([`Table::with`]), which
//! is at most as long as another control call takes.
//!
//! A handle, from the top bit: 0, 7 bits of kind, 8 fixed bits, 32 bits of generation, 16 bits of slot. It is never 0 and
//! fits a Java `long` above zero. A generation comes again after 2^32 objects in one slot.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::time::Duration;

use crossbeam_utils::Backoff;

use super::fault::{Fault, Status, guarded};
use crate::runtime::handover::atomic_box::AtomicBox;

/// Most objects of one kind.
const MOST: usize = 4096;
/// The fixed bits: a number that lacks them was never a handle.
const MARK: u64 = 0xf5;
/// How long a control call waits between looks at an object that another has.
const LOOK_AGAIN: Duration = Duration::from_micros(100);

/// What a handle stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The app's half of an engine.
    Engine = 1,
    /// The audio half of an engine.
    Renderer = 2,
    /// A committed scene.
    Scene = 3,
    /// Samples.
    Clip = 4,
    /// The app's end of a stream.
    Stream = 5,
    /// A device that plays a renderer.
    Output = 6,
}

impl Kind {
    const ALL: [Self; 6] = [
        Self::Engine,
        Self::Renderer,
        Self::Scene,
        Self::Clip,
        Self::Stream,
        Self::Output,
    ];

    /// That a handle is another kind's. A text that is there already: sound calls fail with it too.
    const fn wrong(self) -> Fault {
        let text = match self {
            Self::Engine => "the handle is not an engine's; give an engine's",
            Self::Renderer => "the handle is not a renderer's; give a renderer's",
            Self::Scene => "the handle is not a scene's; give a scene's",
            Self::Clip => "the handle is not a clip's; give a clip's",
            Self::Stream => "the handle is not a stream's; give a stream's",
            Self::Output => "the handle is not an output's; give an output's",
        };
        Fault::fixed(Status::WrongKind, text)
    }
}

const CLOSED: Fault = Fault::fixed(
    Status::Closed,
    "the handle was closed or never was one; use one that is open",
);
const BUSY: Fault = Fault::fixed(
    Status::Busy,
    "another thread is using the handle; give it to one thread",
);
const BROKEN: Fault = Fault::fixed(Status::Panic, "an earlier call panicked; close the handle");

struct Tenant<T> {
    generation: u32,
    broken: bool,
    value: T,
}

struct Slot<T> {
    claimed: AtomicBool,
    generation: AtomicU32,
    tenant: AtomicBox<Tenant<T>>,
}

/// All objects of one kind.
pub struct Table<T> {
    kind: Kind,
    slots: OnceLock<Box<[Slot<T>]>>,
    /// Where to look for a free slot first.
    next: AtomicUsize,
    count: AtomicUsize,
}

/// The kind of a handle.
///
/// # Errors
/// [`Status::Closed`] for a number that never was one.
pub fn kind_of(handle: u64) -> Result<Kind, Fault> {
    let is_marked = handle >> 48 & 0xff == MARK;
    let kind = Kind::ALL.into_iter().find(|k| *k as u64 == handle >> 56);
    kind.filter(|_| is_marked).ok_or(CLOSED)
}

impl<T: Send> Table<T> {
    /// An empty table.
    pub const fn new(kind: Kind) -> Self {
        Self {
            kind,
            slots: OnceLock::new(),
            next: AtomicUsize::new(0),
            count: AtomicUsize::new(0),
        }
    }

    /// Objects in the table.
    pub fn len(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Takes an object in and gives its handle. Control side.
    ///
    /// # Errors
    /// [`Status::Full`] with 4,096 of a kind; the object is dropped then.
    pub fn insert(&self, value: T) -> Result<u64, Fault> {
        let slots = self.slots.get_or_init(|| {
            let slot = |_| Slot {
                claimed: AtomicBool::new(false),
                generation: AtomicU32::new(0),
                tenant: AtomicBox::default(),
            };
            (0..MOST).map(slot).collect()
        });
        let first = self.next.fetch_add(1, Ordering::Relaxed);
        let mut places = (0..MOST).map(|i| first.wrapping_add(i) % MOST);
        let free = |place: &usize| !slots[*place].claimed.swap(true, Ordering::Acquire);
        let Some(place) = places.find(free) else {
            let text = format!("{MOST} handles are open; close some");
            return Err(Fault::new(Status::Full, text));
        };
        let slot = &slots[place];
        let generation = slot.generation.load(Ordering::Relaxed);
        slot.tenant.swap(Some(Box::new(Tenant {
            generation,
            broken: false,
            value,
        })));
        self.count.fetch_add(1, Ordering::Relaxed);
        Ok((self.kind as u64) << 56 | MARK << 48 | u64::from(generation) << 16 | place as u64)
    }

    /// Calls `call` with the object if nobody else has it just now. Wait-free but for the call itself; allocates nothing
    /// unless the call panics.
    ///
    /// # Errors
    /// The call's; [`Status::Busy`]; [`Status::Closed`]; [`Status::WrongKind`]; [`Status::Panic`] now and ever after if
    /// the call panics.
    pub fn try_with<R>(
        &self,
        handle: u64,
        call: impl FnOnce(&mut T) -> Result<R, Fault>,
    ) -> Result<R, Fault> {
        let slot = self.slot(handle)?;
        let mut tenant = take(slot, handle)?;
        if tenant.broken {
            slot.tenant.swap(Some(tenant));
            return Err(BROKEN);
        }
        let mut finished = false;
        let result = guarded(|| {
            let result = call(&mut tenant.value);
            finished = true;
            result
        });
        tenant.broken = !finished;
        slot.tenant.swap(Some(tenant));
        result
    }

    /// Calls `call` with the object as soon as nobody else has it. Control side.
    ///
    /// # Errors
    /// As [`Self::try_with`], but for [`Status::Busy`].
    pub fn with<R>(
        &self,
        handle: u64,
        call: impl FnOnce(&mut T) -> Result<R, Fault>,
    ) -> Result<R, Fault> {
        let mut call = Some(call);
        wait(|| {
            self.try_with(handle, |value| match call.take() {
                Some(call) => call(value),
                None => Err(BUSY),
            })
        })
    }

    /// Takes an object out; its handle is closed from then on. Control side.
    ///
    /// # Errors
    /// [`Status::Closed`], [`Status::WrongKind`].
    pub fn remove(&self, handle: u64) -> Result<T, Fault> {
        let slot = self.slot(handle)?;
        let tenant = wait(|| take(slot, handle))?;
        slot.generation.fetch_add(1, Ordering::Relaxed);
        slot.claimed.store(false, Ordering::Release);
        self.count.fetch_sub(1, Ordering::Relaxed);
        Ok(tenant.value)
    }

    fn slot(&self, handle: u64) -> Result<&Slot<T>, Fault> {
        let kind = kind_of(handle)?;
        if kind != self.kind {
            return Err(self.kind.wrong());
        }
        let slots = self.slots.get().ok_or(CLOSED)?;
        slots.get((handle & 0xffff) as usize).ok_or(CLOSED)
    }
}

/// The slot's object, if it is the handle's.
fn take<T: Send>(slot: &Slot<T>, handle: u64) -> Result<Box<Tenant<T>>, Fault> {
    let generation = (handle >> 16) as u32;
    if slot.generation.load(Ordering::Relaxed) != generation {
        return Err(CLOSED);
    }
    match slot.tenant.take() {
        Some(tenant) if tenant.generation == generation => Ok(tenant),
        Some(other) => {
            // The slot has changed hands meanwhile.
            slot.tenant.swap(Some(other));
            Err(CLOSED)
        }
        None if slot.claimed.load(Ordering::Relaxed) => Err(BUSY),
        None => Err(CLOSED),
    }
}

/// Tries until it is anything but busy.
fn wait<R>(mut attempt: impl FnMut() -> Result<R, Fault>) -> Result<R, Fault> {
    let backoff = Backoff::new();
    loop {
        match attempt() {
            Err(fault) if fault.status == Status::Busy => {}
            done => return done,
        }
        if backoff.is_completed() {
            std::thread::park_timeout(LOOK_AGAIN);
        } else {
            backoff.snooze();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static NUMBERS: Table<u64> = Table::new(Kind::Clip);

    fn status<R: std::fmt::Debug>(result: Result<R, Fault>) -> Status {
        result.expect_err("fails").status
    }

    #[test]
    fn a_handle_outlives_its_object_harmlessly() {
        let table: Table<u64> = Table::new(Kind::Scene);
        assert_eq!(status(table.remove(0)), Status::Closed);
        let mut old = Vec::new();
        for n in 0..3 * MOST as u64 {
            let handle = table.insert(n).expect("has room");
            assert!((handle as i64) > 0);
            assert_eq!(table.with(handle, |value| Ok(*value)), Ok(n));
            assert_eq!(table.remove(handle), Ok(n));
            old.push(handle);
        }
        for handle in old {
            assert_eq!(status(table.with(handle, |_| Ok(()))), Status::Closed);
            assert_eq!(status(table.remove(handle)), Status::Closed);
        }
        assert!(table.is_empty());
    }

    #[test]
    fn foreign_numbers_are_no_handles() {
        let table: Table<u64> = Table::new(Kind::Scene);
        let handle = table.insert(1).expect("has room");
        let other: Table<u64> = Table::new(Kind::Clip);
        let clip = other.insert(2).expect("has room");
        assert_eq!(status(table.with(clip, |_| Ok(()))), Status::WrongKind);
        for wrong in [
            0,
            1,
            u64::MAX,
            handle ^ 1,
            handle ^ 0xffff,
            handle ^ 1 << 40,
            handle ^ 1 << 50,
        ] {
            assert_eq!(status(table.with(wrong, |_| Ok(()))), Status::Closed);
        }
    }

    #[test]
    fn a_full_table_says_so() {
        let table: Table<usize> = Table::new(Kind::Clip);
        let handles: Vec<u64> = (0..MOST)
            .map(|n| table.insert(n).expect("has room"))
            .collect();
        assert_eq!(status(table.insert(0)), Status::Full);
        table.remove(handles[77]).expect("is there");
        assert!(table.insert(1).is_ok());
    }

    #[test]
    fn a_panic_shuts_the_object() {
        let table: Table<u64> = Table::new(Kind::Clip);
        let handle = table.insert(1).expect("has room");
        let broke = table.with(handle, |_| -> Result<(), Fault> { panic!("oh") });
        assert_eq!(status(broke), Status::Panic);
        assert_eq!(status(table.with(handle, |_| Ok(()))), Status::Panic);
        assert_eq!(table.remove(handle), Ok(1));
    }

    #[test]
    fn threads_have_an_object_one_at_a_time() {
        let handle = NUMBERS.insert(0).expect("has room");
        let threads: Vec<_> = (0..8)
            .map(|_| {
                std::thread::spawn(move || {
                    for _ in 0..1000 {
                        let add = |value: &mut u64| {
                            *value += 1;
                            Ok(())
                        };
                        NUMBERS.with(handle, add).expect("is open");
                    }
                })
            })
            .collect();
        for thread in threads {
            thread.join().expect("ends well");
        }
        assert_eq!(NUMBERS.remove(handle), Ok(8000));
    }
}
