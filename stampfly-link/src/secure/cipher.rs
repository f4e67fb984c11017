//! ChaCha20-Poly1305 (RFC 8439) and the derivation of keys, put together of the crates `chacha20` and `poly1305`.
//!
//! The crate `chacha20poly1305` does the same; it unwraps inside, and so a program that links it links a panic handler.
//! What is put together here is compared with it and with Python's `cryptography` in `tests/link/secure_vectors.rs`. The tag is
//! compared by `poly1305`, in constant time.

use chacha20::cipher::{KeyIvInit, StreamCipher};
use chacha20::{ChaCha20, R20, hchacha};
use poly1305::Poly1305;
use poly1305::universal_hash::{KeyInit, UniversalHash};
use zeroize::Zeroize;

/// Length of a key, bytes.
pub const KEY: usize = 32;
/// Length of a tag, bytes.
pub const TAG: usize = 16;
/// Length of a nonce, bytes.
pub const NONCE: usize = 12;

/// A key that is not printed, and overwritten when it is given up.
#[derive(Clone)]
pub struct Secret([u8; KEY]);

impl Secret {
    pub const fn new(bytes: [u8; KEY]) -> Self {
        Self(bytes)
    }

    pub const fn bytes(&self) -> &[u8; KEY] {
        &self.0
    }

    /// A key for one purpose: HChaCha20 (draft-irtf-cfrg-xchacha-03, section 2.2) of this key and what tells the purpose.
    pub fn derive(&self, purpose: [u8; 16]) -> Self {
        let mut derived = hchacha::<R20>(&self.0.into(), &purpose.into());
        let secret = Self(derived.into());
        derived.as_mut_slice().zeroize();
        secret
    }

    /// Encrypts the text in place and returns the tag of it and the head. `None` never happens: no frame is that long.
    pub fn seal(&self, nonce: [u8; NONCE], head: &[u8], text: &mut [u8]) -> Option<[u8; TAG]> {
        let (mut cipher, mac) = self.begin(nonce)?;
        cipher.try_apply_keystream(text).ok()?;
        Some(absorb(mac, head, text).finalize().into())
    }

    /// Decrypts the text in place, if the tag is that of it and the head. If not, nothing has changed.
    pub fn open(&self, nonce: [u8; NONCE], head: &[u8], text: &mut [u8], tag: [u8; TAG]) -> bool {
        let Some((mut cipher, mac)) = self.begin(nonce) else { return false };
        absorb(mac, head, text).verify(&tag.into()).is_ok() && cipher.try_apply_keystream(text).is_ok()
    }

    /// The key stream behind its first block, which is the authenticator's key.
    fn begin(&self, nonce: [u8; NONCE]) -> Option<(ChaCha20, Poly1305)> {
        let mut cipher = ChaCha20::new(&self.0.into(), &nonce.into());
        let mut block = [0; 64];
        cipher.try_apply_keystream(&mut block).ok()?;
        let mac = block.first_chunk::<KEY>().map(|key| Poly1305::new(key.into()));
        block.zeroize();
        Some((cipher, mac?))
    }
}

impl Drop for Secret {
    fn drop(&mut self) {
        self.0.zeroize();
    }
}

impl core::fmt::Debug for Secret {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("(secret)")
    }
}

/// Head, encrypted text, both padded, and their lengths.
fn absorb(mut mac: Poly1305, head: &[u8], text: &[u8]) -> Poly1305 {
    mac.update_padded(head);
    mac.update_padded(text);
    let [a0, a1, a2, a3, a4, a5, a6, a7] = (head.len() as u64).to_le_bytes();
    let [b0, b1, b2, b3, b4, b5, b6, b7] = (text.len() as u64).to_le_bytes();
    mac.update(&[[a0, a1, a2, a3, a4, a5, a6, a7, b0, b1, b2, b3, b4, b5, b6, b7].into()]);
    mac
}
