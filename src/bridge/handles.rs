//! Handle tables: numbers with a generation instead of pointers.
//!
//! Any thread. A slot holds its object in an atomic box; a call takes the object out with one atomic exchange and has it
//! exclusively until it puts it back. Audio calls try once ([`HandleTable::try_with`]); control calls wait for the object
//! ([`HandleTable::with`]), at most as long as another control call takes.
//!
//! A handle, from the top bit: 0, 7 bits of kind, 8 fixed bits, 32 bits of generation, 16 bits of slot. It is never 0 and
//! positive as a Java `long`. A generation repeats after 2^32 objects in one slot.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use crossbeam_utils::Backoff;

use super::error::{CallError, Status, catch_panic};
use crate::runtime::handover::atomic_box::AtomicBox;

/// Maximum number of objects of one kind; few under Miri, which is a thousand times slower.
const MOST: usize = if cfg!(miri) { 16 } else { 4096 };
/// The fixed bits, which tell handles from other numbers.
const MARK: u64 = 0xf5;
/// Time between a control call's attempts to take an object in use.
const RETRY_INTERVAL: Duration = Duration::from_micros(100);

/// Type of a handle's object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The control half of an engine.
    Engine = 1,
    /// The audio half of an engine.
    Renderer = 2,
    /// A committed scene.
    Scene = 3,
    /// The samples of a clip.
    Clip = 4,
    /// The writing end of a stream.
    Stream = 5,
    /// A device that plays a renderer.
    Output = 6,
    /// The progress of a scene's construction.
    Progress = 7,
}

impl Kind {
    const ALL: [Self; 7] = [
        Self::Engine,
        Self::Renderer,
        Self::Scene,
        Self::Clip,
        Self::Stream,
        Self::Output,
        Self::Progress,
    ];

    /// The error for a handle of another kind. Its message is static, for audio calls.
    const fn wrong(self) -> CallError {
        let text = match self {
            Self::Engine => "the handle is not an engine's; pass an engine's",
            Self::Renderer => "the handle is not a renderer's; pass a renderer's",
            Self::Scene => "the handle is not a scene's; pass a scene's",
            Self::Clip => "the handle is not a clip's; pass a clip's",
            Self::Stream => "the handle is not a stream's; pass a stream's",
            Self::Output => "the handle is not an output's; pass an output's",
            Self::Progress => "the handle is not a progress's; pass a progress's",
        };
        CallError::fixed(Status::WrongKind, text)
    }
}

const CLOSED: CallError = CallError::fixed(
    Status::Closed,
    "the handle was closed or never existed; pass an open one",
);
const BUSY: CallError = CallError::fixed(
    Status::Busy,
    "another thread is using the handle; call from one thread",
);
const BROKEN: CallError =
    CallError::fixed(Status::Panic, "an earlier call panicked; close the handle");

struct Entry<T> {
    generation: u32,
    broken: bool,
    value: T,
}

struct Slot<T> {
    claimed: AtomicBool,
    generation: AtomicU32,
    entry: AtomicBox<Entry<T>>,
    /// The object's generation and constant, or [`NO_CONSTANT`].
    constant: AtomicU64,
}

/// The constant of an empty slot. No object has this generation: one begins at 0 and ends at the last.
const NO_CONSTANT: u64 = u64::MAX;

/// The objects of one kind.
pub struct HandleTable<T> {
    kind: Kind,
    slots: OnceLock<Box<[Slot<T>]>>,
    /// First slot to try for the next object.
    next: AtomicUsize,
    count: AtomicUsize,
}

/// The kind of a handle.
///
/// # Errors
/// [`Status::Closed`] for a number that is no handle.
pub fn kind_of(handle: u64) -> Result<Kind, CallError> {
    let is_marked = handle >> 48 & 0xff == MARK;
    let kind = Kind::ALL.into_iter().find(|k| *k as u64 == handle >> 56);
    kind.filter(|_| is_marked).ok_or(CLOSED)
}

impl<T: Send> HandleTable<T> {
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

    /// Adds an object; returns its handle. Control thread.
    ///
    /// # Errors
    /// [`Status::Full`] at 4,096 objects; the object is dropped.
    pub fn insert(&self, value: T) -> Result<u64, CallError> {
        self.insert_with(|| Ok((value, 0)))
    }

    /// Makes and adds an object; returns its handle. The object is not made if the table is full. Beside it is a number
    /// that does not change while the object lives ([`Self::constant`]). Control thread.
    ///
    /// # Errors
    /// [`Status::Full`] at 4,096 objects; those of `make`.
    pub fn insert_with(
        &self,
        make: impl FnOnce() -> Result<(T, u32), CallError>,
    ) -> Result<u64, CallError> {
        let slots = self.slots.get_or_init(|| {
            let slot = |_| Slot {
                claimed: AtomicBool::new(false),
                generation: AtomicU32::new(0),
                entry: AtomicBox::default(),
                constant: AtomicU64::new(NO_CONSTANT),
            };
            (0..MOST).map(slot).collect()
        });
        let first = self.next.fetch_add(1, Ordering::Relaxed);
        let mut indices = (0..MOST).map(|i| first.wrapping_add(i) % MOST);
        let free = |index: &usize| !slots[*index].claimed.swap(true, Ordering::Acquire);
        let Some(index) = indices.find(free) else {
            let text = format!("{MOST} handles are open; close some");
            return Err(CallError::new(Status::Full, text));
        };
        let slot = &slots[index];
        let (value, constant) = match catch_panic(make) {
            Ok(made) => made,
            Err(error) => {
                slot.claimed.store(false, Ordering::Release);
                return Err(error);
            }
        };
        let generation = slot.generation.load(Ordering::Relaxed);
        let constant = u64::from(generation) << 32 | u64::from(constant);
        slot.constant.store(constant, Ordering::Relaxed);
        slot.entry.swap(Some(Box::new(Entry {
            generation,
            broken: false,
            value,
        })));
        self.count.fetch_add(1, Ordering::Relaxed);
        Ok((self.kind as u64) << 56 | MARK << 48 | u64::from(generation) << 16 | index as u64)
    }

    /// Calls `call` with the object if no other call has it. Wait-free except for the call itself; does not allocate unless
    /// the call panics.
    ///
    /// # Errors
    /// The call's; [`Status::Busy`]; [`Status::Closed`]; [`Status::WrongKind`]; [`Status::Panic`] if the call panics, and
    /// from then on.
    pub fn try_with<R>(
        &self,
        handle: u64,
        call: impl FnOnce(&mut T) -> Result<R, CallError>,
    ) -> Result<R, CallError> {
        let slot = self.slot(handle)?;
        let mut entry = take(slot, handle)?;
        if entry.broken {
            slot.entry.swap(Some(entry));
            return Err(BROKEN);
        }
        let mut finished = false;
        let result = catch_panic(|| {
            let result = call(&mut entry.value);
            finished = true;
            result
        });
        entry.broken = !finished;
        slot.entry.swap(Some(entry));
        result
    }

    /// Calls `call` with the object, after waiting for other calls. Control thread.
    ///
    /// # Errors
    /// Those of [`Self::try_with`] except [`Status::Busy`].
    pub fn with<R>(
        &self,
        handle: u64,
        call: impl FnOnce(&mut T) -> Result<R, CallError>,
    ) -> Result<R, CallError> {
        let mut call = Some(call);
        wait(|| {
            self.try_with(handle, |value| match call.take() {
                Some(call) => call(value),
                None => Err(BUSY),
            })
        })
    }

    /// The number beside an object, also while another call has the object. Wait-free.
    ///
    /// # Errors
    /// [`Status::Closed`]; [`Status::WrongKind`].
    pub fn constant(&self, handle: u64) -> Result<u32, CallError> {
        let constant = self.slot(handle)?.constant.load(Ordering::Relaxed);
        if constant != NO_CONSTANT && constant >> 32 == handle >> 16 & 0xffff_ffff {
            Ok(constant as u32)
        } else {
            Err(CLOSED)
        }
    }

    /// Removes an object, which closes its handle. Control thread.
    ///
    /// # Errors
    /// [`Status::Closed`], [`Status::WrongKind`].
    pub fn remove(&self, handle: u64) -> Result<T, CallError> {
        let slot = self.slot(handle)?;
        let entry = wait(|| take(slot, handle))?;
        slot.constant.store(NO_CONSTANT, Ordering::Relaxed);
        slot.generation.fetch_add(1, Ordering::Relaxed);
        slot.claimed.store(false, Ordering::Release);
        self.count.fetch_sub(1, Ordering::Relaxed);
        Ok(entry.value)
    }

    fn slot(&self, handle: u64) -> Result<&Slot<T>, CallError> {
        let kind = kind_of(handle)?;
        if kind != self.kind {
            return Err(self.kind.wrong());
        }
        let slots = self.slots.get().ok_or(CLOSED)?;
        slots.get((handle & 0xffff) as usize).ok_or(CLOSED)
    }
}

/// Takes the slot's object if the generation is the handle's.
fn take<T: Send>(slot: &Slot<T>, handle: u64) -> Result<Box<Entry<T>>, CallError> {
    let generation = (handle >> 16) as u32;
    if slot.generation.load(Ordering::Relaxed) != generation {
        return Err(CLOSED);
    }
    match slot.entry.take() {
        Some(entry) if entry.generation == generation => Ok(entry),
        Some(other) => {
            // Another object took the slot in between.
            slot.entry.swap(Some(other));
            Err(CLOSED)
        }
        None if slot.claimed.load(Ordering::Relaxed) => Err(BUSY),
        None => Err(CLOSED),
    }
}

/// Retries while the object is busy.
fn wait<R>(mut attempt: impl FnMut() -> Result<R, CallError>) -> Result<R, CallError> {
    let backoff = Backoff::new();
    loop {
        match attempt() {
            Err(error) if error.status == Status::Busy => {}
            done => return done,
        }
        if backoff.is_completed() {
            std::thread::park_timeout(RETRY_INTERVAL);
        } else {
            backoff.snooze();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static NUMBERS: HandleTable<u64> = HandleTable::new(Kind::Clip);

    /// Calls of a thread; Miri is a thousand times slower.
    const ADDITIONS: u64 = if cfg!(miri) { 20 } else { 1000 };

    fn status<R: std::fmt::Debug>(result: Result<R, CallError>) -> Status {
        result.expect_err("fails").status
    }

    #[test]
    fn a_handle_outlives_its_object_harmlessly() {
        let table: HandleTable<u64> = HandleTable::new(Kind::Scene);
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
        let table: HandleTable<u64> = HandleTable::new(Kind::Scene);
        let handle = table.insert(1).expect("has room");
        let other: HandleTable<u64> = HandleTable::new(Kind::Clip);
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
    fn a_constant_is_readable_while_the_object_is_in_use() {
        let table: HandleTable<u64> = HandleTable::new(Kind::Scene);
        let first = table.insert_with(|| Ok((1, 66))).expect("has room");
        let read = table.with(first, |_| table.constant(first));
        assert_eq!(read, Ok(66));
        assert_eq!(table.remove(first), Ok(1));
        assert_eq!(status(table.constant(first)), Status::Closed);
        assert_eq!(status(table.constant(first ^ 1)), Status::Closed);
        // The slot's next object has another generation.
        for _ in 0..MOST {
            let next = table.insert_with(|| Ok((2, 77))).expect("has room");
            assert_eq!(table.constant(next), Ok(77));
            assert_eq!(status(table.constant(first)), Status::Closed);
            table.remove(next).expect("is there");
        }
    }

    #[test]
    fn an_object_that_cannot_be_made_takes_no_room() {
        let table: HandleTable<u64> = HandleTable::new(Kind::Scene);
        for _ in 0..2 * MOST {
            let failed = table.insert_with(|| Err(BUSY));
            assert_eq!(status(failed), Status::Busy);
        }
        let panicked = table.insert_with(|| panic!("oh"));
        assert_eq!(status(panicked), Status::Panic);
        assert!(table.is_empty());
        let handles = (0..MOST).map(|n| table.insert(n as u64));
        assert!(handles.into_iter().all(|handle| handle.is_ok()));
        let unused = table.insert_with(|| -> Result<(u64, u32), CallError> { unreachable!() });
        assert_eq!(status(unused), Status::Full);
    }

    #[test]
    fn a_full_table_says_so() {
        let table: HandleTable<usize> = HandleTable::new(Kind::Clip);
        let handles: Vec<u64> = (0..MOST)
            .map(|n| table.insert(n).expect("has room"))
            .collect();
        assert_eq!(status(table.insert(0)), Status::Full);
        table.remove(handles[MOST / 2]).expect("is there");
        assert!(table.insert(1).is_ok());
    }

    #[test]
    fn a_panic_shuts_the_object() {
        let table: HandleTable<u64> = HandleTable::new(Kind::Clip);
        let handle = table.insert(1).expect("has room");
        let broke = table.with(handle, |_| -> Result<(), CallError> { panic!("oh") });
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
                    for _ in 0..ADDITIONS {
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
        assert_eq!(NUMBERS.remove(handle), Ok(8 * ADDITIONS));
    }
}
