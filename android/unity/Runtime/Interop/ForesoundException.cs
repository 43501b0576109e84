using System;
using System.Text;

namespace Foresound.Interop
{
    /// <summary>A failed call of the library. The message is one line: the cause and the remedy.</summary>
    public sealed class ForesoundException : Exception
    {
        /// <summary>The kind of failure.</summary>
        public Status Status { get; }

        internal ForesoundException(Status status, string message) : base(message)
        {
            Status = status;
        }

        /// <summary>Throws if a control call failed; on the thread of the call, which has the message.</summary>
        internal static void Check(Status status)
        {
            if (status != Status.Ok) throw new ForesoundException(status, LastError());
        }

        /// <summary>The message of this thread's last failed call.</summary>
        internal static unsafe string LastError()
        {
            byte* text = Native.LastError();
            int length = 0;
            while (text[length] != 0) length++;
            return Encoding.UTF8.GetString(text, length);
        }
    }

    /// <summary>Texts for the library.</summary>
    static class Utf8
    {
        /// <summary>UTF-8 with a terminating zero; null for null.</summary>
        internal static byte[] Bytes(string text)
        {
            if (text == null) return null;
            if (text.IndexOf('\0') >= 0) throw new ArgumentException("a text contains a zero; remove it");
            return Encoding.UTF8.GetBytes(text + "\0");
        }
    }
}
